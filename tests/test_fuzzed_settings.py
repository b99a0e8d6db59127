"""Settings files and headers of tables with random errors are read, or refused in one line."""

import pytest

from benchmarks.fuzz import unexpected_errors
from benchmarks.fuzzed_settings import KINDS, FuzzedText

every_kind = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)


@every_kind
def test_the_texts_are_right_without_errors(kind: FuzzedText) -> None:
    for text in kind.texts:
        kind.read(text)


@every_kind
def test_a_text_with_errors_is_read_or_refused_in_one_line(kind: FuzzedText) -> None:
    assert unexpected_errors(kind, 150, seed=1) == []


def test_what_is_not_expected_is_found() -> None:
    def fail(text: str) -> object:
        raise KeyError(text)

    (found,) = unexpected_errors(FuzzedText("a", ("x = 1",), fail), 1, seed=1)
    assert found.startswith("KeyError(")
