"""The cache of machine code bears any damage, and a place where nothing can be kept."""

import os
import resource
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
import pytest

import shiplog.compiled
from shiplog import machine_code
from shiplog.cli.console import print_cache_warnings
from shiplog.errors import CacheWarning
from shiplog.machine_code import CheckedCache, delete_outdated, usable_folder

DAMAGES: dict[str, Callable[[Path], object]] = {
    "empty": lambda path: path.write_bytes(b""),
    "cut off": lambda path: path.write_bytes(path.read_bytes()[:-100]),
    "garbage": lambda path: path.write_bytes(os.urandom(5000)),
    "one bit": lambda path: path.write_bytes(flipped(path.read_bytes())),
    "of numba": lambda path: path.write_bytes(b"\x80\x04\x8c\x060.68.1\x94."),
}


def flipped(data: bytes) -> bytes:
    middle = len(data) // 2
    return data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :]


def double(x: float) -> float:
    return 2.0 * x


def compiled(function: Callable[[float], float]) -> Any:  # noqa: ANN401
    dispatcher = numba.njit(function)
    dispatcher._cache = CheckedCache(function)
    return dispatcher


def result_and_hits(x: float = 3.0) -> tuple[float, int]:
    """Call a function as a new process does; return how many times it was found compiled, too."""
    function = compiled(double)
    return function(x), sum(function.stats.cache_hits.values())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(machine_code, "_warned", set())
    place = tmp_path / "cache"
    place.mkdir()
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(place))
    return place


@pytest.fixture(scope="module")
def kept_code(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, bytes]]:
    """Yield the name and the content of the file of a compiled function."""
    place = tmp_path_factory.mktemp("code")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(numba.config, "CACHE_DIR", str(place))
        assert result_and_hits() == (6.0, 0)
        (file,) = (path for path in place.rglob("*") if path.is_file())
        yield str(file.relative_to(place)), file.read_bytes()


@pytest.fixture
def file(folder: Path, kept_code: tuple[str, bytes]) -> Path:
    """Return the file of a compiled function in the folder."""
    path = folder / kept_code[0]
    path.parent.mkdir()
    path.write_bytes(kept_code[1])
    return path


@pytest.mark.usefixtures("file")
def test_kept_machine_code_is_used() -> None:
    assert result_and_hits() == (6.0, 1)


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_named_and_made_anew(file: Path, damage: str) -> None:
    DAMAGES[damage](file)
    with pytest.warns(CacheWarning) as caught:
        assert result_and_hits() == (6.0, 0)
    (text,) = (str(each.message) for each in caught)
    assert text.startswith("a file of the cache of compiled loops cannot be read (its checksum")
    assert text.endswith(f": {file}")
    assert result_and_hits() == (6.0, 1)


def test_a_folder_in_the_place_of_a_file_is_named_in_each_run(file: Path) -> None:
    file.unlink()
    file.mkdir()
    with pytest.warns(
        CacheWarning, match=f"is a directory.*delete.*: {file}".replace("is", "[Ii]s")
    ):
        assert result_and_hits() == (6.0, 0)


def test_code_of_another_signature_under_the_name_of_this_one_is_not_used(file: Path) -> None:
    compiled(double)(3)  # of an integer
    (other,) = (path for path in file.parent.iterdir() if path != file)
    file.write_bytes(other.read_bytes())
    assert result_and_hits(0.25) == (0.5, 0)


def test_a_place_that_cannot_be_written_is_named_once_and_bypassed(folder: Path) -> None:
    folder.rmdir()
    folder.write_text("a file")
    with pytest.warns(CacheWarning) as caught:
        assert [result_and_hits(), result_and_hits()] == [(6.0, 0), (6.0, 0)]
    (text,) = (str(each.message) for each in caught)
    assert "cannot be written (Not a directory), so that each run compiles them; " in text
    assert f"set NUMBA_CACHE_DIR to another folder: {folder}" in text


def test_a_full_disk_is_named_and_leaves_nothing_incomplete(folder: Path) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        with pytest.warns(CacheWarning, match="cannot be written \\(File too large\\)"):
            assert result_and_hits() == (6.0, 0)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [path for path in folder.rglob("*") if path.is_file()] == []


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may read and write everything")
def test_a_folder_that_is_read_only_is_used_as_far_as_it_goes(file: Path) -> None:
    file.parent.chmod(0o500)
    assert result_and_hits() == (6.0, 1)
    with pytest.warns(CacheWarning, match=r"cannot be written \(Permission denied\)"):
        assert compiled(double)(3) == 6


def test_a_function_that_is_in_no_file_is_compiled_without_a_cache(folder: Path) -> None:
    names: dict[str, Callable[[float], float]] = {}
    exec("def twice(x): return 2.0 * x", names)  # noqa: S102
    assert shiplog.compiled.compiled(names["twice"])(4.0) == 8.0
    assert list(folder.iterdir()) == []


def test_the_first_place_where_a_folder_can_be_made_is_taken(folder: Path) -> None:
    blocked = folder / "file"
    blocked.touch()
    assert (
        usable_folder([blocked, folder / "a", folder / "b"], "shiplog-1") == folder / "a/shiplog-1"
    )
    assert not (folder / "b").exists()


def test_without_a_place_the_cache_is_in_a_temporary_folder_of_this_run(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked, temporary = folder / "file", folder / "tmp"
    blocked.touch()
    temporary.mkdir()
    monkeypatch.setattr(machine_code.tempfile, "tempdir", str(temporary))  # type: ignore[attr-defined]
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(blocked))
    with pytest.warns(CacheWarning, match=f"set NUMBA_CACHE_DIR to another folder: {blocked}$"):
        found = usable_folder([blocked], "shiplog-1")
    assert found.is_dir()
    assert found.parent.parent == temporary
    assert os.environ["NUMBA_CACHE_DIR"] == str(found.parent)


def test_without_a_temporary_folder_nothing_is_kept(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = folder / "file"
    blocked.touch()
    monkeypatch.setattr(machine_code.tempfile, "tempdir", str(folder / "none"))  # type: ignore[attr-defined]
    with pytest.warns(CacheWarning, match="cannot be written"):
        found = usable_folder([blocked], "shiplog-1")
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(found))
    monkeypatch.setattr(machine_code, "_warned", set())
    with pytest.warns(CacheWarning, match="cannot be written"):
        assert result_and_hits() == (6.0, 0)


def test_folders_of_other_versions_that_vanish_or_are_locked_do_not_matter(tmp_path: Path) -> None:
    current, old, link = (tmp_path / f"shiplog-{name}" for name in ("1", "2", "3"))
    current.mkdir()
    old.mkdir()
    link.symlink_to(tmp_path / "none")
    os.utime(old, (0, 0))
    delete_outdated(current)
    assert sorted(tmp_path.iterdir()) == [current, link]


def test_the_command_line_prints_a_warning_of_the_cache_in_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    others: list[str] = []
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        monkeypatch.setattr(warnings, "showwarning", lambda text, *_: others.append(str(text)))
        print_cache_warnings()
        warnings.warn("no place: /a", CacheWarning, stacklevel=1)
        warnings.warn("other", UserWarning, stacklevel=1)
    assert capsys.readouterr().err == "warning: no place: /a\n"
    assert others == ["other"]
