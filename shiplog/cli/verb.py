"""A verb of the command line, and the exit codes."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum


class ExitCode(IntEnum):
    """What the exit code of the command means."""

    OK = 0
    FAILURE = 1
    USAGE = 2  # the command line or a setting is wrong
    DATA_LOST = 3  # finished, but a part of the input could not be read
    INTERRUPTED = 4  # by a signal: a recording is whole to there, of other work nothing is left


@dataclass(frozen=True)
class Verb:
    """One verb: `shiplog VERB ...`.

    A package adds a verb by an entry point of the group ``shiplog.verbs`` whose name is the verb
    and whose object is a `Verb`. Its module is imported for ``shiplog --help`` too, so that heavy
    libraries are best imported inside `run`.

    Attributes
    ----------
    help
        One line for the list of verbs.
    configure
        Adds the arguments to the verb's parser.
    run
        Does the work on the parsed arguments and returns the exit code. A `ShiplogError` becomes
        one line on stderr.
    examples
        Command lines for the end of the help text, one a line.
    unneeded
        Modules that libraries import although this verb does not need them, and whose import takes
        long. In the process of the command, a package is not found, as where it is not installed;
        a part of a package, with a dot in its name, is empty.
    expand
        Returns the arguments after the verb with a short form replaced by the full one.
    """

    help: str
    configure: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], ExitCode]
    examples: tuple[str, ...]
    unneeded: tuple[str, ...] = ()
    expand: Callable[[Sequence[str]], list[str]] = list
