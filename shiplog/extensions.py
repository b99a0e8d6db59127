"""Objects that installed packages add to shiplog by entry point."""

import sys
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import TypeVar

from .errors import ShiplogError, UsageError
from .units import did_you_mean

T = TypeVar("T")


def declared_entries(group: str) -> tuple[EntryPoint, ...]:
    """List the entry points that installed packages declare in a group, importing none.

    The metadata of the packages are read once, and anew where a package was installed since.
    """
    folders = (Path(place) for place in sys.path)
    stamps = tuple((str(path), path.stat().st_mtime_ns) for path in folders if path.is_dir())
    return _entries_by_group(stamps).get(group, ())


@lru_cache(maxsize=1)
def _entries_by_group(_: tuple[tuple[str, int], ...], /) -> dict[str, tuple[EntryPoint, ...]]:
    """Read the entry points, given the folders of packages and when these changed last."""
    found = entry_points()
    return {group: tuple(found.select(group=group)) for group in found.groups}


def extension_names(group: str) -> tuple[str, ...]:
    """List the names of a group of entry points, in alphabetical order, without importing any.

    Examples
    --------
    >>> extension_names("shiplog.recorders")
    ('simulate',)
    """
    return tuple(sorted({entry.name for entry in declared_entries(group)}))


def extension_sources(group: str) -> list[Path]:
    """List the Python files of the packages that declare a group's entry points, importing none.

    Of each package these are all files below its top-level module.
    """
    files: set[Path] = set()
    for module in {entry.module.partition(".")[0] for entry in declared_entries(group)}:
        spec = find_spec(module)
        folders = list((spec and spec.submodule_search_locations) or ())
        files |= {file for folder in folders for file in Path(folder).rglob("*.py")}
        if spec and spec.origin and not folders:
            files.add(Path(spec.origin))
    return sorted(files)


def load_extension(group: str, name: str, kind: type[T], noun: str) -> T:
    """Import the object that an installed package declares under a name.

    Parameters
    ----------
    group
        The group of entry points, such as ``shiplog.ship_models``.
    name
        The name within the group.
    kind
        The class of which the object must be an instance.
    noun
        What the object is, for error messages, such as ``ship model``.

    Raises
    ------
    UsageError
        No package declares the name.
    ShiplogError
        Two packages declare the name, the import fails, or the object is of another class. The
        message names the package.
    """
    entry = _entry(group, name, noun)
    try:
        found = entry.load()
    except Exception as error:  # a foreign module may raise anything
        raise ShiplogError(
            f"the {noun} {name!r} cannot be loaded from {entry.value} "
            f"({type(error).__name__}: {' '.join(str(error).split())}); "
            f"reinstall or remove the package {_package(entry)}"
        ) from error
    if not isinstance(found, kind):
        raise ShiplogError(
            f"the {noun} {name!r} of the package {_package(entry)} must be a {kind.__name__}, "
            f"but {entry.value} is a {type(found).__name__}"
        )
    return found


def _entry(group: str, name: str, noun: str) -> EntryPoint:
    entries = [entry for entry in declared_entries(group) if entry.name == name]
    if not entries:
        names = extension_names(group)
        known = f"installed: {', '.join(names)}" if names else "none is installed: pip install -e ."
        raise UsageError(f"no {noun} {name!r}{did_you_mean(name, names)}; {known}")
    if len(entries) > 1:
        packages = " and ".join(sorted(map(_package, entries)))
        raise ShiplogError(f"the {noun} {name!r} is declared by {packages}; remove one of them")
    return entries[0]


def _package(entry: EntryPoint) -> str:
    """Name the package of an entry, for an error: its metadata take milliseconds to parse."""
    return entry.dist.name if entry.dist else entry.module.partition(".")[0]
