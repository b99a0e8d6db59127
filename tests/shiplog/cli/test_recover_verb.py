"""The verb `recover` states what is kept and what is lost, and its exit code does."""

from argparse import ArgumentParser
from pathlib import Path

import pytest
from mcap_files import flip_bit, mcap_chunk_ranges, samples, spoil, write_flushed

from shiplog import UsageError, read
from shiplog.cli.recover_verb import RECOVER
from shiplog.cli.verb import ExitCode


def recover(source: Path, target: Path) -> ExitCode:
    parser = ArgumentParser()
    RECOVER.configure(parser)
    return RECOVER.run(parser.parse_args([str(source), "-o", str(target)]))


def test_lost_messages_are_counted_with_their_place_and_the_exit_code_is_3(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, good = tmp_path / "bad.mcap", tmp_path / "good.mcap"
    _, data = write_flushed(path)
    start, end = mcap_chunk_ranges(data)[2]
    path.write_bytes(spoil(data, (start + end) // 2))
    assert recover(path, good) == ExitCode.DATA_LOST
    out, err = capsys.readouterr()
    assert ["/speed/test", "400", "100"] in [line.split() for line in out.splitlines()]
    assert f"damaged at bytes {start} to {end}: lost 200 messages of /yaw_rate/test" in err
    assert samples(read(good)) == samples(read(path))


def test_where_nothing_is_lost_the_exit_code_is_0(tmp_path: Path) -> None:
    path, good = tmp_path / "bad.mcap", tmp_path / "good.mcap"
    original, data = write_flushed(path)
    path.write_bytes(flip_bit(data, 8 * 9 + 1))  # in the length of the header
    assert recover(path, good) == ExitCode.OK
    assert samples(read(good)) == samples(original)


def test_what_is_kept_is_counted_in_the_singular_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, good = tmp_path / "whole.mcap", tmp_path / "good.mcap"
    write_flushed(path)
    recover(path, good)
    assert "also 0 attachments and 1 metadata record\n" in capsys.readouterr().out


def test_the_damaged_file_is_not_written_over(tmp_path: Path) -> None:
    path = tmp_path / "bad.mcap"
    _, data = write_flushed(path)
    with pytest.raises(UsageError, match="named twice"):
        recover(path, path)
    assert path.read_bytes() == data
