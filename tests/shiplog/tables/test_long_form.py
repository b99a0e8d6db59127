"""Trials in data frames, CSV and Parquet: nothing is lost on the way there and back."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_logs import require_same, trial

from shiplog.errors import LogError, ShiplogError
from shiplog.mcap.reader import read
from shiplog.mcap.writer import write
from shiplog.tables.convert import convert
from shiplog.tables.csv_form import read_csv, write_csv
from shiplog.tables.long_form import from_frame, to_frame
from shiplog.tables.parquet_form import read_parquet, write_parquet
from shiplog.types import Channel, TrialLog

Write, Read = Callable[[TrialLog, Path], None], Callable[[Path], TrialLog]
FORMS = pytest.mark.parametrize(
    ("write_form", "read_form"),
    [(write_csv, read_csv), (write_parquet, read_parquet)],
    ids=["csv", "parquet"],
)


@FORMS
def test_nothing_is_lost_in_a_file(tmp_path: Path, write_form: Write, read_form: Read) -> None:
    write_form(trial(), tmp_path / "there")
    back = read_form(tmp_path / "there")
    assert back.name == "there"
    require_same(trial(), back)


@FORMS
def test_an_empty_trial_stays_empty(tmp_path: Path, write_form: Write, read_form: Read) -> None:
    write_form(TrialLog("nothing", ()), tmp_path / "there")
    require_same(TrialLog("nothing", ()), read_form(tmp_path / "there"))


@FORMS
def test_a_failed_write_leaves_the_file_unchanged(
    tmp_path: Path, write_form: Write, read_form: Read
) -> None:
    good, bad = (
        tmp_path / "good",
        replace(trial(), vessel_toml="\ud800"),
    )  # cannot be encoded in UTF-8
    write_form(trial(), good)
    with pytest.raises(UnicodeEncodeError):
        write_form(bad, good)
    require_same(trial(), read_form(good))
    assert list(tmp_path.iterdir()) == [good]
    with pytest.raises(ShiplogError, match="there is no folder"):
        write_form(trial(), tmp_path / "gone" / "x")


@pytest.mark.parametrize("middle", ["there.csv", "there.parquet", "there.CSV"])
def test_from_mcap_through_a_table_and_back_nothing_is_lost(tmp_path: Path, middle: str) -> None:
    write(trial(), tmp_path / "a.mcap")
    convert(tmp_path / "a.mcap", tmp_path / middle)
    _, warnings = convert(tmp_path / middle, tmp_path / "b.mcap")
    assert warnings == []
    require_same(read(tmp_path / "a.mcap"), read(tmp_path / "b.mcap"))
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


STAMPS = st.lists(st.integers(0, 2**63 - 1), max_size=6)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=6)
BITS_64 = st.integers(0, 2**64 - 1)


@st.composite
def channels(draw: st.DrawFn) -> Channel:
    fields = draw(st.sampled_from([(), ("north", "east"), ("latitude", "longitude", "altitude")]))
    stamps = np.array(draw(STAMPS), np.int64)
    width = max(len(fields), 1)
    bits = draw(st.lists(BITS_64, min_size=len(stamps) * width, max_size=len(stamps) * width))
    values = np.array(bits, np.uint64).view(np.float64)
    return Channel(
        draw(st.sampled_from(["yaw_rate", "position", "x"])),
        draw(TEXTS),
        draw(TEXTS),
        stamps,
        stamps[::-1],
        values.reshape(-1, width) if fields else values,
        fields,
        draw(st.dictionaries(TEXTS, TEXTS, max_size=2)),
    )


TRIALS = st.builds(
    TrialLog,
    TEXTS,
    st.lists(channels(), max_size=3, unique_by=lambda c: c.topic).map(tuple),
    st.dictionaries(TEXTS, TEXTS, max_size=2),
    st.none() | TEXTS,
)


@settings(derandomize=True, deadline=None, max_examples=150)
@given(log=TRIALS)
def test_any_trial_survives_csv(tmp_path_factory: pytest.TempPathFactory, log: TrialLog) -> None:
    path = tmp_path_factory.mktemp("any") / "any.csv"
    write_csv(log, path)
    require_same(log, read_csv(path))


@settings(derandomize=True, deadline=None, max_examples=50)
@given(log=TRIALS)
def test_any_trial_survives_parquet_and_a_frame(
    tmp_path_factory: pytest.TempPathFactory, log: TrialLog
) -> None:
    path = tmp_path_factory.mktemp("any") / "any.parquet"
    write_parquet(log, path)
    require_same(log, read_parquet(path))
    require_same(log, from_frame(to_frame(log)))


# ---- frames


def test_a_frame_has_a_row_for_each_sample_and_field() -> None:
    frame = to_frame(trial())
    assert list(frame.columns) == ["topic", "field", "measured_ns", "received_ns", "value"]
    east = frame[(frame["topic"] == "/position/gps") & (frame["field"] == "east")]
    assert east["value"].tolist() == trial()["position"].values[:, 1].tolist()
    assert len(frame) == 5 + 10 + 0 + 5


def test_a_frame_may_be_cut_and_changed() -> None:
    frame = to_frame(trial())
    cut = frame[frame["measured_ns"] < trial()["position"].measured_ns[2]]
    assert [len(channel) for channel in from_frame(cut)] == [2, 2, 0, 2]


def test_a_frame_without_its_header_is_an_error() -> None:
    frame = to_frame(trial())
    frame.attrs.clear()
    with pytest.raises(LogError, match="keep the attrs"):
        from_frame(frame)


def test_a_frame_with_half_a_position_is_an_error() -> None:
    frame = to_frame(trial())
    half = frame[~((frame["field"] == "east") & (frame["value"] > 2))]
    with pytest.raises(LogError, match="rows of its field 'east' do not match those of 'north'"):
        from_frame(half)


# ---- CSV


def test_a_csv_begins_with_its_mark_and_can_be_read_with_pandas(tmp_path: Path) -> None:
    path, values = tmp_path / "a.csv", np.array([1 / 7, np.nan, -np.nan, -0.0, 3])
    log = replace(trial(), channels=(replace(trial().channels[3], values=values),))
    write_csv(log, path)
    assert path.read_text(encoding="utf-8").startswith("# shiplog csv 2\n# metadata {")
    frame = pd.read_csv(path, comment="#")
    assert frame["topic"].tolist() == ["/yaw_rate/mems"] * 5
    assert frame["measured_ns"].tolist() == trial().channels[3].measured_ns.tolist()
    np.testing.assert_allclose(frame["value"], values, rtol=1e-15)


def damage_error(tmp_path: Path, old: str, new: str) -> str:
    path = tmp_path / "a.csv"
    write_csv(trial(), path)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8", newline="")
    with pytest.raises(LogError) as caught:
        read_csv(path)
    message = str(caught.value)
    assert "\n" not in message
    assert "a.csv" in message
    return message


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        ("# shiplog csv 2", "# shiplog csv 3", "install a newer shiplog"),
        ("# shiplog csv 2", "t,r", "it needs a layout"),
        ("topic,field,", "theme,field,", "line 11 should be 'topic,field,"),
        (
            "\n/position/gps,north,",
            "\n/position/gps,up,",
            "no channel '/position/gps' with a field",
        ),
        ("\n/position/gps,north,", "\n/positon/gps,north,", "did you mean '/position/gps'?"),
        ("\n/position/gps,north,", "\n/position/gps,", "line 17 cannot be read (it has 4 columns"),
        (",0.3333333333333333\n", ",0.33x\n", "line 18 cannot be read (could not convert"),
        (",1700000000000000001,", ",17000000000000000010,", "more than 64 bits"),
        (",1700000000000000001,", ",-1,", "times before 1970"),
        (",1700000000000000001,", ",1.7e18,", "line 12 cannot be read (invalid literal"),
        ("# vessel", "# vassel", "unknown key 'vassel'"),
        ('"fields": [],', '"fields": ["up"],', "no message schema has"),
        ('"unit": "rad/s", ', "", "missing 1 required"),
    ],
)
def test_a_damaged_csv_is_an_error_with_its_line(
    tmp_path: Path, old: str, new: str, part: str
) -> None:
    assert part in damage_error(tmp_path, old, new)


def test_a_csv_that_was_cut_off_is_an_error(tmp_path: Path) -> None:
    write_csv(trial(), tmp_path / "a.csv")
    text = (tmp_path / "a.csv").read_bytes()
    for cut in (len(text) - 2, len(text) - 8, len(text) - 40):
        (tmp_path / "b.csv").write_bytes(text[:cut])
        with pytest.raises(LogError, match=r"cut off|cannot be read"):
            read_csv(tmp_path / "b.csv")


def test_rows_after_the_end_of_a_csv_are_an_error(tmp_path: Path) -> None:
    write_csv(trial(), tmp_path / "a.csv")
    with (tmp_path / "a.csv").open("a") as stream:
        stream.write("/speed/log,value,1,1,2.0\n")
    with pytest.raises(LogError, match="rows after the last line"):
        read_csv(tmp_path / "a.csv")


def test_a_csv_saved_with_other_line_ends_still_reads(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    log = replace(trial(), channels=trial().channels[1:])
    write_csv(log, path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    require_same(log, read_csv(path))


def test_a_missing_file_and_binary_data_are_errors(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"no such file.*gone\.csv$"):
        read_csv(tmp_path / "gone.csv")
    with pytest.raises(LogError, match="no such file"):
        read_parquet(tmp_path / "gone.parquet")
    (tmp_path / "a.csv").write_bytes(b"# shiplog csv 1\n\xff\n")
    with pytest.raises(LogError, match="not UTF-8 text"):
        read_csv(tmp_path / "a.csv")


def test_a_parquet_file_of_another_program_is_an_error(tmp_path: Path) -> None:
    pd.DataFrame({"a": [1.0]}).to_parquet(tmp_path / "a.parquet")
    with pytest.raises(LogError, match="not of shiplog"):
        read_parquet(tmp_path / "a.parquet")
    (tmp_path / "b.parquet").write_bytes(b"PAR1 no more")
    with pytest.raises(LogError, match="Parquet"):
        read_parquet(tmp_path / "b.parquet")


def test_heavy_packages_are_imported_only_where_they_are_needed() -> None:
    code = (
        "import sys, shiplog.tables.convert, shiplog.tables.wide, shiplog.checks.data_quality; "
        "print({'pandas', 'pyarrow', 'scipy', 'numba', 'rerun', 'control'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_pandas_reads_a_csv_whose_source_has_a_number_sign(tmp_path: Path) -> None:
    times = np.arange(3) * 10**9
    channel = Channel("yaw_rate", "gyro#2", "rad/s", times, times, np.arange(3.0))
    write_csv(TrialLog("x", (channel,)), tmp_path / "x.csv")
    frame = pd.read_csv(tmp_path / "x.csv", comment="#")
    assert list(frame.columns) == ["topic", "field", "measured_ns", "received_ns", "value"]
    assert frame["topic"].unique().tolist() == ["/yaw_rate/gyro#2"]
    assert frame["value"].tolist() == [0, 1, 2]
    assert read_csv(tmp_path / "x.csv").channels[0].topic == channel.topic
