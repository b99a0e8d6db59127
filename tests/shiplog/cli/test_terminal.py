"""Output never fails for the encoding of a terminal, a closed stream, or a reader that has left."""

import ast
import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from places import PROJECT, SAMPLE_DATA

from shiplog.cli.console import print_tables, print_toml, write_json
from shiplog.cli.terminal import HANDLER, READABLE, encodable
from shiplog.text_table import TextTable

LOG = SAMPLE_DATA / "zigzag_20_20.mcap"
PACKAGES = ("shiplog", "recorders", "analysis")


def shiplog(command: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[bytes]:
    """Run a shell command in which ``shiplog`` is the command of this project."""
    script = f'shiplog() {{ "{sys.executable}" -m shiplog "$@"; }}; {command}'
    paths = {"PYTHONPATH": str(PROJECT), "LOG": str(LOG)}
    return subprocess.run(
        ["bash", "-c", script],
        cwd=folder,
        env=os.environ | paths | environment,
        capture_output=True,
        check=False,
    )


def strings_of(path: Path) -> Iterator[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and id(node) not in docstrings:
            yield str(node.value)


def test_each_character_of_our_own_texts_has_a_readable_form_in_ascii() -> None:
    no_text = {"\ufeff", "\u2032", "\u2033"}  # marks of an encoding and of minutes, in input
    own = {
        character
        for package in PACKAGES
        for path in (PROJECT / package).rglob("*.py")
        for text in strings_of(path)
        for character in text
        if not character.isascii()
    }
    assert {"±", "°", "²", "σ"} < own
    assert not [c for c in own - no_text if "\\" in encodable(c, "ascii")]


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "cp437", "koi8-r", "utf-8"])
def test_any_character_can_be_encoded_and_those_that_are_in_the_encoding_stay(
    encoding: str,
) -> None:
    text = "".join(map(chr, range(1, 0x3000))) + "\U0001f6a2\ud800\udc80" + "".join(READABLE)
    encoded = encodable(text, encoding)
    assert encoded.encode(encoding).decode(encoding) == encoded
    kept = text.encode(encoding, "ignore").decode(encoding)
    assert encodable(kept, encoding) == kept


def test_other_errors_of_a_codec_are_raised() -> None:
    with pytest.raises(UnicodeDecodeError):
        b"\xff".decode("ascii", HANDLER)


def test_a_table_is_aligned_after_the_replacement_of_characters(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(type(sys.stdout), "encoding", "ascii")
    print_tables([TextTable("Курс", ("a", "rate\n[°/s²]"), (("x", "± 3"), ("y", "4")))])
    text = capsys.readouterr().out
    assert text.isascii()
    assert "[deg/s^2]" in text
    assert "+- 3" in text
    lines = [line.rstrip() for line in text.splitlines() if line.startswith(("|", "+"))]
    assert len(lines) > 4
    assert len({len(line) for line in lines}) == 1


def test_json_and_toml_keep_their_content_in_any_encoding(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    value = {"курс °\U0001f6a2": "\x1b[2J\u202e\n"}
    monkeypatch.setattr(type(sys.stdout), "encoding", "cp1252")
    write_json(value, "-")
    text = capsys.readouterr().out
    assert text.isascii()
    assert json.loads(text) == value
    print_toml('name = "курс °\U0001f6a2"')
    text = capsys.readouterr().out
    assert text.isascii()
    assert tomllib.loads(text) == {"name": "курс °\U0001f6a2"}


def test_a_report_is_printed_in_ascii(tmp_path: Path) -> None:
    done = shiplog(
        'shiplog info "$LOG" && shiplog replay --help', tmp_path, PYTHONIOENCODING="ascii"
    )
    assert done.returncode == 0
    assert done.stdout.isascii()
    assert b"/yaw_rate/simulated" in done.stdout


def test_names_of_files_are_escaped_on_stdout_and_in_errors(tmp_path: Path) -> None:
    command = (
        r"""cp "$LOG" $'a\x1b[2J\xff.mcap'; shiplog info $'a\x1b[2J\xff.mcap' | head -1;"""
        r"""shiplog info "$LOG" $'\x9b.mcap'; shiplog replay "$LOG" $'b\x1b[2J\n'"""
    )
    done = shiplog(command, tmp_path)
    assert done.stdout.startswith(b"a\\x1b[2J\\udcff.mcap: from 2026")
    assert b"\x1b" not in done.stdout + done.stderr
    assert b"unrecognized arguments: b\\x1b[2J\\n" in done.stderr


@pytest.mark.parametrize("arguments", ["--help", "--version", "replay --help"])
@pytest.mark.parametrize(
    ("redirection", "code"), [(">/dev/full", 1), ("| true; exit ${PIPESTATUS[0]}", 0)]
)
def test_a_help_that_cannot_be_written_is_an_error_unless_nobody_reads_it(
    tmp_path: Path, arguments: str, redirection: str, code: int
) -> None:
    done = shiplog(f"shiplog {arguments} {redirection}", tmp_path)
    assert done.returncode == code
    errors = b"shiplog: cannot write the output: No space left on device\n"
    assert done.stderr == (errors if code else b"")


@pytest.mark.parametrize(
    ("redirection", "code"),
    [
        (">&-", 0),
        ("<&- >&- 2>&-", 0),
        ("| true; exit ${PIPESTATUS[0]}", 0),
        ("2>&1 | true; exit ${PIPESTATUS[0]}", 0),
        (">/dev/full", 1),
    ],
)
def test_work_ends_although_its_output_is_not_read(
    tmp_path: Path, redirection: str, code: int
) -> None:
    done = shiplog(f'shiplog convert "$LOG" out.csv {redirection}', tmp_path)
    assert done.returncode == code
    assert (tmp_path / "out.csv").stat().st_size > 1_000_000
    errors = b"shiplog: cannot write the output: No space left on device\n"
    assert done.stderr == (errors if code else b"")
