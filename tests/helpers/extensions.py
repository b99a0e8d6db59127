"""Install a package of tests/extensions into a folder, and run shiplog with it."""

import os
import subprocess
import sys
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from places import PROJECT

EXTENSIONS = PROJECT / "tests" / "extensions"


def installed(name: str, config: pytest.Config, *folders: Path) -> Mapping[str, str]:
    """Install the package tests/extensions/NAME; return the environment in which it is found.

    It is kept in pytest's cache under a hash of its files: numba caches the machine code of a
    function by the place of its file.

    Parameters
    ----------
    name
        The folder of the package.
    config
        Has the cache.
    folders
        Further folders of installed packages.
    """
    source = EXTENSIONS / name
    digest = sha256(b"".join(file.read_bytes() for file in sorted(source.glob("*.*")))).hexdigest()
    target = config.cache.mkdir("extensions") / f"{name}-{digest[:16]}"
    if not target.exists():
        _install(source, target)
    path = os.pathsep.join(map(str, (*folders, target, PROJECT)))
    return os.environ | {"PYTHONPATH": path}


def _install(source: Path, target: Path) -> None:
    """Install a package into a folder, which has its name only once it is complete."""
    options = ("--quiet", "--no-deps", "--no-index", "--no-build-isolation")
    with TemporaryDirectory(dir=target.parent) as part:
        done = subprocess.run(
            [
                sys.executable,
                "-m",
                "pip",
                "install",
                *options,
                "--target",
                f"{part}/packages",
                source,
            ],
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        complete = Path(part) / "packages"
        complete.rename(target)


def run_shiplog(
    environment: Mapping[str, str], folder: Path, *arguments: object
) -> subprocess.CompletedProcess[str]:
    """Run `python -m shiplog` with the arguments in a folder."""
    return run_python(environment, folder, "-m", "shiplog", *arguments)


def run_python(
    environment: Mapping[str, str], folder: Path, *arguments: object
) -> subprocess.CompletedProcess[str]:
    """Run Python with the arguments in a folder."""
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        env=environment,
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


def import_from(environment: Mapping[str, str], patch: pytest.MonkeyPatch) -> None:
    """Let this process, for a test, find the packages that are installed in an environment."""
    for place in reversed(environment["PYTHONPATH"].split(os.pathsep)):
        patch.syspath_prepend(place)


def code_blocks(page: Path) -> dict[str, str]:
    """Return the code blocks of a page by the file they are headed with, as `FILE`: before ```."""
    result, lines = {}, page.read_text(encoding="utf-8").splitlines()
    for i, line in enumerate(lines):
        name = lines[i - 2].strip("`:") if i > 1 and line.startswith("```") else ""
        if name and lines[i - 2] == f"`{name}`:":
            end = lines.index("```", i + 1)
            result[name] = "\n".join(lines[i + 1 : end]) + "\n"
    return result


def declare(folder: Path, package: str, group: str, **entries: str) -> None:
    """Write the metadata of an installed package that declares entry points, and nothing else."""
    metadata = folder / f"{package}-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n", encoding="utf-8"
    )
    lines = [f"[{group}]", *(f"{name} = {value}" for name, value in entries.items())]
    (metadata / "entry_points.txt").write_text("\n".join(lines), encoding="utf-8")
