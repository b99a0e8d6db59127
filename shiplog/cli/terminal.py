"""Standard streams that do not end the work, whatever their encoding and whoever reads them."""

import codecs
import io
import os
import re
import sys
from typing import Any, TextIO
from unicodedata import category, normalize

HANDLER = "shiplog.readable"  # name of the handler of characters that an encoding lacks
# characters and what stands for them; superscripts and subscripts follow
_WORDS = (
    "° deg, ± +-, · *, × x, … ..., – -, — -, − -, ≤ <=, ≥ >=, ≈ ~, → ->, ∞ inf, √ sqrt, \u0302 ^, "
    "α alpha, β beta, δ delta, Δ Delta, θ theta, λ lambda, µ u, μ u, ρ rho, σ sigma, φ phi, χ chi, "
    "ψ psi, ω omega, Ω Omega, ’ ', ‘ ', “ \", ” \", • *, ⁻ ^-"
)
READABLE = {
    **dict(pair.split(" ", 1) for pair in _WORDS.split(", ")),
    **{sign: f"^{number}" for number, sign in enumerate("⁰¹²³⁴⁵⁶⁷⁸⁹")},
    **{sign: str(number) for number, sign in enumerate("₀₁₂₃₄₅₆₇₈₉")},
}


def _replace_readably(error: UnicodeError) -> tuple[str, int]:
    """Replace characters that an encoding lacks, for `codecs.register_error`."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = "".join(map(_readable, error.object[error.start : error.end]))
    return re.sub(
        r"(?<=[-\d])\^", "", text
    ), error.end  # one sign for an exponent of several digits


def _readable(character: str) -> str:
    """Return what stands for a character: a word, its letter without accents, or its code."""
    if character in READABLE:
        return READABLE[character]
    plain = "".join(c for c in normalize("NFKD", character) if category(c) != "Mn")
    return plain if plain and plain.isascii() else ascii(character)[1:-1]


codecs.register_error(HANDLER, _replace_readably)


def encodable(text: str, encoding: str) -> str:
    """Return a text with the characters replaced that an encoding lacks.

    Parameters
    ----------
    text
        The text.
    encoding
        Name of the encoding.

    Examples
    --------
    >>> encodable("± 0.02°/s², 10⁻⁶ σ", "ascii"), encodable("± 0.02 σ", "cp1252")
    ('+- 0.02deg/s^2, 10^-6 sigma', '± 0.02 sigma')
    """
    return text.encode(encoding, HANDLER).decode(encoding)


class _Output(io.FileIO):
    """A standard stream of the process: what cannot be written is discarded, and the error kept.

    The work goes on, so that a review or a recording is complete although nobody reads the output.
    """

    error: OSError | None = None

    def write(self, data: Any, /) -> int:  # noqa: ANN401 - any buffer
        """Write bytes; those after an error are discarded."""
        if self.error is None:
            try:
                return super().write(data)
            except BlockingIOError:
                raise
            except OSError as error:
                self.error = error
        return len(data)


def prepare_streams() -> None:
    """Make stdout and stderr of this process accept any text, also where they are closed."""
    for descriptor in range(3):  # a file must not get the number of a closed stream
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    sys.stdout = _stream(sys.stdout, 1, line_buffering=False)
    sys.stderr = _stream(sys.stderr, 2, line_buffering=True)


def _stream(stream: TextIO | None, descriptor: int, *, line_buffering: bool) -> TextIO:
    if isinstance(stream, io.TextIOWrapper) and os.name == "nt":  # its console is no file
        stream.reconfigure(errors=HANDLER)
        return stream
    output = _Output(descriptor, "wb", closefd=False)
    return io.TextIOWrapper(
        io.BufferedWriter(output),
        encoding="utf-8" if stream is None else stream.encoding,
        errors=HANDLER,
        line_buffering=line_buffering or output.isatty(),
    )


def stdout_error() -> OSError | None:
    """Return the error for which a part of stdout is lost; a reader that has left is none.

    To be called at the end of the work.
    """
    sys.stdout.flush()
    output = getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    error = output.error if isinstance(output, _Output) else None
    return None if isinstance(error, BrokenPipeError) else error
