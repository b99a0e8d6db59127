"""Take the picture of a report: two pages of its PDF, side by side.

    shiplog report trial.mcap --pdf report.pdf
    python docs/images/make_report.py report.pdf 1 4 report.png

It needs pdftoppm, of Debian's `poppler-utils`.
"""

import argparse
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image, ImageOps

RESOLUTION_DPI = 72
COLOURS = 256  # text and lines need no more, and the file is smaller
FRAME = "#b9c2cb"


def main() -> None:
    """Draw two pages of a PDF beside each other, each in a thin frame."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pdf", type=Path)
    parser.add_argument("pages", type=int, nargs=2, help="their numbers, from 1")
    parser.add_argument("picture", type=Path, help="the .png to write")
    arguments = parser.parse_args()
    pages = [page_image(arguments.pdf, number) for number in arguments.pages]
    width, height = pages[0].size
    picture = Image.new("RGB", (2 * width, height), "white")
    for column, page in enumerate(pages):
        picture.paste(page, (column * width, 0))
    picture.quantize(COLOURS).save(arguments.picture, optimize=True)


def page_image(pdf: Path, number: int) -> Image.Image:
    """Return a page of a PDF as a picture with a frame."""
    with TemporaryDirectory() as folder:
        command = ["pdftoppm", "-png", "-singlefile", "-r", str(RESOLUTION_DPI)]
        chosen = ["-f", str(number), "-l", str(number), str(pdf), f"{folder}/page"]
        subprocess.run([*command, *chosen], check=True)  # noqa: S603 - of our own words
        with Image.open(f"{folder}/page.png") as page:
            return ImageOps.expand(page.convert("RGB"), border=1, fill=FRAME)


if __name__ == "__main__":
    main()
