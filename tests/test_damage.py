"""A sample of the variants of `python -m benchmarks.damage`, each read in every way."""

from itertools import chain, islice
from pathlib import Path

from benchmarks.damage import judge, original
from benchmarks.damaged_files import bursts, cuts, flips, orders


def test_no_damage_gives_a_wrong_value_or_loses_an_intact_mcap_chunk(tmp_path: Path) -> None:
    data = original()[0]
    step = len(data) // 20
    variants = chain(
        cuts(data, step), flips(data, step), bursts(data, 20), islice(orders(data), 0, None, 4)
    )
    outcomes = [judge(variant, tmp_path / "damaged.mcap") for variant in variants]
    assert len(outcomes) > 60
    assert [outcome for outcome in outcomes if outcome.errors] == []
    assert all(outcome.result == "whole" for outcome in outcomes if outcome.way == "bit")
