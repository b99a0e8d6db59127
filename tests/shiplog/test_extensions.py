"""Objects that packages add by entry point: found by name, reported in one line where broken."""

from importlib.metadata import entry_points
from pathlib import Path

import pytest
from extensions import declare

from shiplog import ShiplogError, UsageError, extensions
from shiplog.extensions import extension_names, extension_sources, load_extension

GROUP = "shiplog.for_tests"


def load(name: str) -> Path:
    return load_extension(GROUP, name, Path, "folder")


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of installed packages with a module that holds a path and one that raises."""
    (tmp_path / "sound_module.py").write_text(
        "from pathlib import Path\nPLACE = Path('here')\nNUMBER = 3\n", encoding="utf-8"
    )
    (tmp_path / "broken_module.py").write_text(
        "raise RuntimeError('no licence\\nfor this computer')\n", encoding="utf-8"
    )
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_names_are_listed_without_importing_anything(packages: Path) -> None:
    declare(packages, "broken", GROUP, zulu="broken_module:A", alpha="no_such_module:B")
    assert extension_names(GROUP) == ("alpha", "zulu")
    assert extension_names("shiplog.nothing") == ()


def test_the_metadata_of_packages_are_read_once_and_again_where_one_was_installed(
    packages: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scans = []
    monkeypatch.setattr(extensions, "entry_points", lambda: scans.append(0) or entry_points())
    declare(packages, "one", GROUP, alpha="sound_module:PLACE")
    for _ in range(3):
        assert extension_names(GROUP) == ("alpha",)
    assert len(scans) == 1
    declare(packages, "other", GROUP, zulu="sound_module:PLACE")
    assert extension_names(GROUP) == ("alpha", "zulu")
    assert len(scans) == 2


def test_an_object_is_found_by_its_name(packages: Path) -> None:
    declare(packages, "sound", GROUP, place="sound_module:PLACE")
    assert load("place") == Path("here")


def test_an_unknown_name_is_reported_with_the_installed_ones(packages: Path) -> None:
    with pytest.raises(UsageError, match=r"no folder 'place'; none is installed: pip install"):
        load("place")
    declare(packages, "sound", GROUP, place="sound_module:PLACE")
    with pytest.raises(
        UsageError, match=r"no folder 'plac'; did you mean 'place'\?; installed: place"
    ):
        load("plac")


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("broken_module:A", "RuntimeError: no licence for this computer"),
        ("no_such_module:A", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("sound_module:ABSENT", "AttributeError"),
    ],
)
def test_a_broken_package_is_named_in_one_line_and_breaks_no_other(
    packages: Path, value: str, message: str
) -> None:
    declare(packages, "broken", GROUP, mine=value)
    declare(packages, "sound", GROUP, place="sound_module:PLACE")
    with pytest.raises(ShiplogError, match="reinstall or remove the package broken") as caught:
        load("mine")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert load("place") == Path("here")


def test_an_object_of_another_class_is_reported(packages: Path) -> None:
    declare(packages, "sound", GROUP, number="sound_module:NUMBER")
    with pytest.raises(ShiplogError, match=r"of the package sound must be a Path, but .* is a int"):
        load("number")


def test_a_name_of_two_packages_is_reported(packages: Path) -> None:
    declare(packages, "one", GROUP, place="sound_module:PLACE")
    declare(packages, "other", GROUP, place="sound_module:PLACE")
    with pytest.raises(ShiplogError, match="'place' is declared by one and other; remove one"):
        load("place")


def test_the_sources_of_a_package_are_listed_without_importing_it(packages: Path) -> None:
    (packages / "folder").mkdir()
    for file in ("folder/__init__.py", "folder/part.py"):
        (packages / file).write_text("raise RuntimeError\n", encoding="utf-8")
    declare(packages, "broken", GROUP, one="broken_module:A", two="folder.part:B", three="absent:C")
    sources = [file.relative_to(packages).as_posix() for file in extension_sources(GROUP)]
    assert sources == ["broken_module.py", "folder/__init__.py", "folder/part.py"]
