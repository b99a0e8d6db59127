"""Parquet of shiplog: its checksum, and files that are damaged, edited or hostile."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from places import HOSTILE_CASES
from pyarrow import compute, parquet
from small_logs import require_same, trial

from shiplog.cli.main import main
from shiplog.errors import LogError
from shiplog.tables.parquet_form import read_parquet, write_parquet


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_parquet(trial(), tmp_path / "a.parquet")
    return tmp_path / "a.parquet"


def rewrite(path: Path, change: Callable[[pa.Table], pa.Table]) -> Path:
    """Write a table again as another program would, in another compression."""
    parquet.write_table(change(parquet.read_table(path)), path, compression="gzip")
    return path


def replaced(table: pa.Table, name: str, column: object) -> pa.Table:
    return table.set_column(table.column_names.index(name), name, column)


def test_a_table_that_another_program_wrote_again_unchanged_has_its_checksum(path: Path) -> None:
    plain = rewrite(path, lambda t: replaced(t, "topic", t.column("topic").cast("string")))
    require_same(trial(), log := read_parquet(plain))
    assert log.warnings == ()


def test_a_changed_value_is_a_warning(path: Path) -> None:
    log = read_parquet(
        rewrite(path, lambda t: replaced(t, "value", compute.multiply(t.column("value"), 2.0)))
    )
    assert "was changed since shiplog wrote it" in log.warnings[0]
    assert log["position"].values[1, 1] == 2.0


@pytest.mark.parametrize("name", ["topic", "field"])
def test_a_changed_label_is_an_error_or_a_warning(path: Path, name: str) -> None:
    labels = parquet.read_table(path).column(name).cast("string").to_pylist()
    swapped = pa.array([*labels[:5][::-1], *labels[5:]])
    log = read_parquet(rewrite(path, lambda t: replaced(t, name, swapped)))
    assert log.warnings == ()  # five equal labels
    with pytest.raises(LogError, match="the header has no channel"):
        read_parquet(rewrite(path, lambda t: replaced(t, name, pa.array(["x", *labels[1:]]))))


def test_a_changed_header_is_a_warning(path: Path) -> None:
    def change(table: pa.Table) -> pa.Table:
        header = table.schema.metadata[b"shiplog"].replace(b"zig-zag 20", b"zig-zag 10")
        return table.replace_schema_metadata({**table.schema.metadata, b"shiplog": header})

    assert "was changed since" in read_parquet(rewrite(path, change)).warnings[0]


def test_a_table_without_a_checksum_cannot_be_verified(path: Path) -> None:
    def change(table: pa.Table) -> pa.Table:
        return table.replace_schema_metadata({b"shiplog": table.schema.metadata[b"shiplog"]})

    require_same(trial(), log := read_parquet(rewrite(path, change)))
    assert "the table has no checksum" in log.warnings[0]


@pytest.mark.parametrize(
    ("name", "kind", "part"),
    [
        ("measured_ns", pa.float64(), "whole numbers of ns"),
        ("received_ns", pa.string(), "whole numbers of ns"),
        ("measured_ns", pa.timestamp("us"), "whole numbers of ns"),
    ],
)
def test_times_of_another_type_are_an_error(
    path: Path, name: str, kind: pa.DataType, part: str
) -> None:
    zeros = pa.array(np.zeros(20, np.int64)).cast(kind)
    with pytest.raises(LogError, match=part):
        read_parquet(rewrite(path, lambda t: replaced(t, name, zeros)))


@pytest.mark.parametrize("name", ["topic", "field", "measured_ns", "received_ns"])
def test_empty_cells_are_an_error_that_counts_them(path: Path, name: str) -> None:
    def change(table: pa.Table) -> pa.Table:
        column = table.column(name).combine_chunks()
        return replaced(table, name, pa.concat_arrays([pa.nulls(2, column.type), column[2:]]))

    with pytest.raises(LogError, match=f"2 empty cells in the column '{name}'"):
        read_parquet(rewrite(path, change))


def test_an_empty_value_is_not_measured(path: Path) -> None:
    def change(table: pa.Table) -> pa.Table:
        values = table.column("value").combine_chunks()
        return replaced(table, "value", pa.concat_arrays([values[:3], pa.nulls(17, pa.float64())]))

    log = read_parquet(rewrite(path, change))
    assert log.warnings
    assert np.isnan(log["position"].values).all()


@pytest.mark.parametrize(
    "change",
    [
        lambda t: t.drop_columns(["value"]),
        lambda t: t.rename_columns(["topic", "topic", *t.column_names[2:]]),
        lambda t: replaced(t, "value", pa.array(["x"] * 20)),
        lambda t: replaced(t, "value", pa.array([[1.0]] * 20)),
        lambda t: t.replace_schema_metadata({"shiplog": b"\xff"}),
        lambda t: t.replace_schema_metadata({"shiplog": b""}),
    ],
)
def test_a_table_of_other_columns_is_an_error_in_one_line(
    path: Path, change: Callable[[pa.Table], pa.Table]
) -> None:
    with pytest.raises(LogError) as caught:
        read_parquet(rewrite(path, change))
    assert "\n" not in str(caught.value)


def test_more_rows_than_a_file_can_hold_are_refused_before_they_are_read(path: Path) -> None:
    zeros = pa.array(np.zeros(1_100_000, np.int64))
    topics = pa.DictionaryArray.from_arrays(zeros.cast(pa.int32()), pa.array(["/rpm/x"]))
    values = zeros.cast(pa.float64())
    metadata = parquet.read_table(path).schema.metadata
    arrays = [topics, topics, zeros, zeros, values]
    table = pa.Table.from_arrays(arrays, names=list(parquet.read_table(path).column_names))
    parquet.write_table(table.replace_schema_metadata(metadata), path, compression="zstd")
    with pytest.raises(LogError, match="1100000 rows, more than its size can hold"):
        read_parquet(path)


@pytest.mark.parametrize("name", ["bad_utf8.parquet", "null_time.parquet"])
def test_hostile_tables_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    hostile = HOSTILE_CASES / name
    if not hostile.exists():
        pytest.skip(f"no {hostile.name} beside the project")
    assert main(["convert", str(hostile), str(tmp_path / "a.mcap")]) == 1
    assert len(capsys.readouterr().err.splitlines()) == 1
