import os
import subprocess
import sys
from pathlib import Path

import pytest
from places import PROJECT

from shiplog import ShiplogError
from shiplog.files import atomic_write, claimed_name


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


WRITER = """
import os, signal, sys
from shiplog.files import atomic_write
with atomic_write("out.txt") as part:
    part.write_text("half of")
    print("writing", flush=True)
    sys.stdin.readline()
    part.write_text("theirs")
"""


def _started_writer(folder: Path) -> "subprocess.Popen[str]":
    process = subprocess.Popen(
        [sys.executable, "-c", WRITER],
        env=os.environ | {"PYTHONPATH": os.fspath(PROJECT)},
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "writing\n"
    return process


def test_a_second_writer_of_a_name_is_refused_and_the_first_goes_on(tmp_path: Path) -> None:
    with _started_writer(tmp_path) as first:
        with (
            pytest.raises(ShiplogError, match=r"another process is writing it; .*out\.txt"),
            atomic_write(tmp_path / "out.txt"),
        ):
            pytest.fail("the block must not run")
        assert not (tmp_path / "out.txt").exists()
        first.communicate("go on\n")
    assert {f.name: f.read_text() for f in tmp_path.iterdir()} == {"out.txt": "theirs"}


def test_what_a_killed_writer_has_left_does_not_block_the_next_one(tmp_path: Path) -> None:
    with _started_writer(tmp_path) as first:
        first.kill()
    assert [f.name for f in tmp_path.iterdir()] == [".out.txt.part"]
    with atomic_write(tmp_path / "out.txt") as part:
        part.write_text("ours")
    assert {f.name: f.read_text() for f in tmp_path.iterdir()} == {"out.txt": "ours"}


def test_the_writer_of_a_name_may_claim_it_again(tmp_path: Path) -> None:
    with claimed_name(tmp_path / "a.mcap"):
        with claimed_name(tmp_path / "a.mcap"):
            pass
        assert [f.name for f in tmp_path.iterdir()] == [".a.mcap.part"]
    assert list(tmp_path.iterdir()) == []


def test_the_hidden_file_of_another_writer_is_not_deleted(tmp_path: Path) -> None:
    with claimed_name(tmp_path / "a.mcap") as hidden:
        hidden.unlink()
        hidden.write_text("theirs")
    assert hidden.read_text() == "theirs"


def test_nothing_is_written_through_a_link_in_place_of_the_hidden_file(tmp_path: Path) -> None:
    (tmp_path / ".out.txt.part").symlink_to(tmp_path / "victim")
    with pytest.raises(ShiplogError, match="cannot write"), atomic_write(tmp_path / "out.txt"):
        pytest.fail("the block must not run")
    assert not (tmp_path / "victim").exists()
