import os
from pathlib import Path

import pytest

from shiplog import ShiplogError
from shiplog.files import atomic_write


def test_the_final_name_appears_only_when_the_block_succeeds(tmp_path: Path) -> None:
    final = tmp_path / "out.txt"
    with atomic_write(final) as part:
        part.write_text("whole")
        assert not final.exists()
        assert part.parent == tmp_path
    assert final.read_text() == "whole"
    assert list(tmp_path.iterdir()) == [final]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_after_any_error_the_existing_file_is_unchanged(
    tmp_path: Path, error: type[BaseException]
) -> None:
    final = tmp_path / "out.txt"
    final.write_text("before")

    def fail(part: Path) -> None:
        part.write_text("half of")
        raise error

    with pytest.raises(error), atomic_write(final) as part:
        fail(part)
    assert final.read_text() == "before"
    assert list(tmp_path.iterdir()) == [final]


def test_a_full_disk_is_an_error_that_names_the_file(tmp_path: Path) -> None:
    def fail() -> None:
        raise OSError(28, "No space left on device")

    with (
        pytest.raises(ShiplogError, match=r"no space left on device.*out.txt"),
        atomic_write(tmp_path / "out.txt"),
    ):
        fail()
    assert not list(tmp_path.iterdir())


def test_a_folder_is_rejected_before_the_block_runs(tmp_path: Path) -> None:
    for folder in (tmp_path, f"{tmp_path}{os.sep}", "", "."):
        with pytest.raises(ShiplogError, match="it is a folder"), atomic_write(folder):
            pytest.fail("the block must not run")


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with (
        pytest.raises(ShiplogError, match=r"there is no folder .*nowhere"),
        atomic_write(tmp_path / "nowhere" / "out.txt"),
    ):
        pytest.fail("the block must not run")


def test_a_file_in_place_of_the_folder_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ShiplogError, match="cannot write"), atomic_write(tmp_path / "file" / "x"):
        pytest.fail("the block must not run")


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="the superuser may write anywhere"
)
def test_a_folder_without_write_permission_is_an_error(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(ShiplogError, match="permission denied"), atomic_write(tmp_path / "x"):
            pytest.fail("the block must not run")
    finally:
        tmp_path.chmod(0o700)
