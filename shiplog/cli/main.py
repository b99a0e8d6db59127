"""The `shiplog` command: find the verb, run it, report errors in one line.

Results go to stdout, everything else to stderr. Only the verb that is asked for is imported.
"""

import argparse
import gc
import os
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

from shiplog.errors import ShiplogError, UsageError
from shiplog.extensions import declared_entries, extension_names, load_extension
from shiplog.interrupts import deferred, handled_signals, interruptible, take_signals
from shiplog.printable import printable, shortened
from shiplog.version import __version__

from .console import print_cache_warnings, print_line
from .terminal import prepare_streams, stdout_error
from .verb import ExitCode, Verb

GROUP = "shiplog.verbs"
# new objects before a search for garbage; a replay leaves none of size, and imports are kept
RARE_COLLECTION = 100_000
MAX_ERROR_CHARACTERS = 20_000  # an error may show a text of a file, of any length
ORDER = (
    "record",
    "info",
    "convert",
    "replay",
    "identify",
    "estimate",
    "check",
    "report",
)  # others follow by name


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb.

    Parameters
    ----------
    arguments
        The command line after the program's name; that of the process by default.

    Returns
    -------
    int
        An `ExitCode`. Errors of the input are reported in one line on stderr.
    """
    if arguments is None:
        take_signals()
        prepare_streams()
        print_cache_warnings()
        return _run(sys.argv[1:], is_process=True)
    with handled_signals(), deferred():
        return _run(list(arguments), is_process=False)


def _run(arguments: list[str], *, is_process: bool) -> int:
    """Run one verb, and report what ends it other than its own end."""
    try:
        with interruptible():
            return _run_verb(arguments, is_process=is_process)
    except UsageError as error:
        return _fail(error, ExitCode.USAGE)
    except ShiplogError as error:
        return _fail(error, ExitCode.FAILURE)
    except OSError as error:
        return _fail(f"cannot write the output: {error.strerror or error}", ExitCode.FAILURE)
    except KeyboardInterrupt:
        return _fail("interrupted; no output is incomplete", ExitCode.INTERRUPTED)


def _run_verb(arguments: list[str], *, is_process: bool) -> int:
    parser = _parser(arguments)
    parsed = parser.parse_args(_expanded(arguments))
    if "verb" not in parsed:
        parser.print_help(sys.stderr)
        return ExitCode.USAGE
    verb: Verb = parsed.verb
    if is_process:
        _prepare_process(verb)
    code = verb.run(parsed)
    if error := stdout_error():
        raise error
    if is_process:
        gc.freeze()  # the end of the process, too, would search all modules for garbage
    return code


def _prepare_process(verb: Verb) -> None:
    """Prepare the process for the work of one verb, most of which is the import of libraries."""
    sys.meta_path.insert(0, _UnneededModules(verb.unneeded))
    gc.set_threshold(RARE_COLLECTION)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # on small matrices threads only wait


class _EmptyModule(Loader):
    """Makes a module with nothing in it."""

    def exec_module(self, module: ModuleType) -> None:
        """Execute nothing."""


class _UnneededModules(MetaPathFinder):
    """Finds none of the unneeded packages, and of the unneeded parts of packages empty ones.

    A package is missing as where it is not installed. A part such as ``numpy.f2py`` is installed
    with its package, which relies on it. None in `sys.modules` would not do for either: libraries
    compiled by Cython take it for the module.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names = frozenset(names)

    def find_spec(
        self, fullname: str, _path: Sequence[str] | None, _target: ModuleType | None = None, /
    ) -> ModuleSpec | None:
        """Return the empty part, raise `ModuleNotFoundError`, or leave it to other finders."""
        if fullname not in self._names:
            return None
        if "." in fullname:
            return ModuleSpec(fullname, _EmptyModule())
        raise ModuleNotFoundError(f"No module named {fullname!r}", name=fullname)


def _fail(error: object, code: ExitCode) -> ExitCode:
    text = shortened(" ".join(str(error).split()), MAX_ERROR_CHARACTERS)
    print_line(f"shiplog: {text}", to_stderr=True)
    return code


class _ArgumentParser(argparse.ArgumentParser):
    """Parser whose errors quote arguments in characters that print, and whose help is complete."""

    def parse_known_args(  # type: ignore[override]
        self,
        args: Sequence[str] | None = None,
        namespace: Any = None,  # noqa: ANN401 - as argparse has it
    ) -> tuple[Any, list[str]]:
        """Parse all arguments: an unknown one is an error of the verb that it follows.

        Else argparse passes it on to the parser of all verbs, which prints a usage without options.
        """
        parsed, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return parsed, unknown

    def error(self, message: str) -> NoReturn:
        """Print the usage and the error, and end the process."""
        super().error(printable(message))

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        """End the process after a help; raise OSError where it could not be written."""
        if not status and (error := stdout_error()):
            raise error
        super().exit(status, message)


def _parser(arguments: Sequence[str]) -> argparse.ArgumentParser:
    """Return the parser: of the verb that is asked for, or, to list them, of all."""
    names = _verb_names()
    first = _first(arguments)
    asked = first if first in names else None
    parser = _ArgumentParser(
        prog="shiplog",
        description="Record, convert, replay, identify and check sea trials.",
        epilog="shiplog VERB --help shows the options of a verb, with examples.",
    )
    parser.add_argument("--version", action="version", version=f"shiplog {__version__}")
    parsers = parser.add_subparsers(metavar="VERB")
    for name in (asked,) if asked else names:
        verb = _load(name) if asked else _load_for_list(name)
        text = f"{verb.help[0].upper()}{verb.help[1:]}."
        own = parsers.add_parser(
            name,
            help=verb.help,
            description=text,
            epilog="\n  ".join(("examples:", *verb.examples)) if verb.examples else None,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        verb.configure(own)
        own.set_defaults(verb=verb)
    return parser


def _first(arguments: Sequence[str]) -> str | None:
    """Return the first argument that is no option; it names the verb."""
    return next((text for text in arguments if not text.startswith("-")), None)


def _expanded(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with the short form of a verb replaced by its full one."""
    name = _first(arguments)
    if name is None or name not in _verb_names():
        return list(arguments)
    rest = arguments.index(name) + 1
    return [*arguments[:rest], *_load(name).expand(arguments[rest:])]


def _verb_names() -> list[str]:
    """List the installed verbs: ours in the order of a trial's way, then the others by name."""
    names = extension_names(GROUP)
    if not names:
        raise ShiplogError("no verb is installed; install shiplog with: pip install -e .")
    return sorted(
        names, key=lambda name: (ORDER.index(name) if name in ORDER else len(ORDER), name)
    )


def _load(name: str) -> Verb:
    """Import a verb; raises `ShiplogError` that names the package where that fails."""
    for entry in declared_entries(GROUP):
        if entry.name == name:
            _require_not_shadowed(entry.module.partition(".")[0])
    return load_extension(GROUP, name, Verb, "verb")


def _load_for_list(name: str) -> Verb:
    """Import a verb; one that cannot be loaded is listed with the reason."""
    try:
        return _load(name)
    except ShiplogError as error:
        reason = str(error).replace("%", "%%")  # argparse formats help texts
        return Verb(f"({reason})", lambda _: None, lambda _: ExitCode.FAILURE, ())


def _require_not_shadowed(package: str) -> None:
    """Refuse a folder in the working directory that shadows `recorders` or `analysis`.

    Their names are common; under ``python -m shiplog`` such a folder is imported in their place.
    """
    home = Path(__file__).resolve().parents[2]
    if not (home / package).is_dir():
        return
    spec = find_spec(package)
    places = [spec.origin, *(spec.submodule_search_locations or ())] if spec else []
    where = next((Path(place).resolve() for place in places if place), home / package)
    if home not in where.parents:
        raise ShiplogError(
            f"another package named {package!r} shadows shiplog's own; "
            f"run from another folder or rename it: {where}"
        )
