"""Options of a format as a trial file and a log's metadata state them."""

import argparse
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from shiplog.errors import UsageError
from shiplog.units import did_you_mean

from .format import StreamFormat


class _OptionParser(argparse.ArgumentParser):
    """A parser of the options of a format, whose errors are exceptions."""

    def __init__(self, stream_format: StreamFormat) -> None:
        super().__init__(add_help=False, allow_abbrev=False)
        stream_format.configure(self)

    @property
    def actions(self) -> list[argparse.Action]:
        """The options."""
        return self._actions  # argparse has no public list

    def error(self, message: str) -> Any:  # noqa: ANN401 - it never returns
        raise UsageError(message)


def parse_options(
    stream_format: StreamFormat, given: Mapping[str, object], where: str, others: Sequence[str] = ()
) -> argparse.Namespace:
    """Parse the options of a format that are given as keys and values.

    Parameters
    ----------
    stream_format
        The format.
    given
        Values by key; ``date = "2026-05-01"`` is ``--date 2026-05-01`` on the command line, and
        true is an option without a value.
    where
        What the options belong to, for messages.
    others
        Further keys that are possible there, for the hint at a wrong one.

    Raises
    ------
    UsageError
        A key is unknown, or a value is not possible.
    """
    parser = _OptionParser(stream_format)
    known = [name.lstrip("-") for action in parser.actions for name in action.option_strings]
    words = []
    for key, value in given.items():
        option = key.replace("_", "-")
        if option not in known:
            raise UsageError(
                f"{where}: unknown key {key!r}{did_you_mean(option, (*known, *others))}"
            )
        if value is not False:
            words.append(f"--{option}" if value is True else f"--{option}={value}")
    try:
        return parser.parse_args(words)
    except UsageError as error:
        raise UsageError(f"{where}: {error}") from error


def parse_options_text(stream_format: StreamFormat, text: str, where: str) -> argparse.Namespace:
    """Parse the options of a format from the text of `options_text`.

    Raises
    ------
    UsageError
        The text has other options than the format; `where` names what it belongs to.
    """
    try:
        return _OptionParser(stream_format).parse_args(shlex.split(text))
    except (UsageError, ValueError) as error:
        raise UsageError(f"{where}: {error}") from error


def options_text(stream_format: StreamFormat, options: argparse.Namespace) -> str:
    """Return the options that are not the default ones, as they stand on a command line."""
    words = []
    for action in _OptionParser(stream_format).actions:
        value = getattr(options, action.dest, action.default)
        if value == action.default:
            continue
        name = action.option_strings[-1]
        words.append(name if action.nargs == 0 else f"{name}={value}")
    return shlex.join(words)
