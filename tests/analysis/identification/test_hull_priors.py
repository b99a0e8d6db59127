"""The MMG model is fitted with the priors of the hull, where the vessel has one."""

from dataclasses import replace

import pytest

from analysis.identification.hull_priors import with_hull_priors, with_stated_hull
from shiplog import TrialLog, Vessel
from shiplog.ships import ship_model
from shiplog.ships.mmg_priors import mmg_with_hull
from shiplog.vessel.hull import Hull

MMG, NORRBIN = ship_model("mmg"), ship_model("norrbin")
HULL = Hull(
    breadth=32.0, draught=10.0, block_coefficient=0.7, rudder_area=36.0, rudder_aspect_ratio=1.8,
    propeller_diameter=7.0,
)  # fmt: skip
SHIP = Vessel("a ship", None, length=200.0, hull=HULL)


def test_the_mmg_model_alone_takes_the_priors_of_the_hull() -> None:
    (norrbin, mmg), warnings = with_hull_priors([NORRBIN, MMG], SHIP)
    assert norrbin is NORRBIN
    assert (mmg.name, warnings) == ("mmg", ())
    assert mmg.parameters == mmg_with_hull(MMG, HULL.form(200.0)).parameters
    assert mmg.parameter("m").start == pytest.approx(2 * 0.7 * 0.16)
    assert mmg.parameter("f0").start != MMG.parameter("f0").start


@pytest.mark.parametrize("ship", [None, replace(SHIP, hull=Hull()), replace(SHIP, length=None)])
def test_without_a_hull_or_a_length_the_priors_are_those_of_ships_in_general(
    ship: Vessel | None,
) -> None:
    assert with_hull_priors([MMG], ship) == ([MMG], ())


def test_a_hull_outside_the_regressions_gives_a_warning() -> None:
    wide = replace(SHIP, hull=replace(HULL, breadth=80.0))
    (mmg,), (warning,) = with_hull_priors([MMG], wide)
    assert "L/B = 2.5" in warning
    assert mmg.parameter("yv") == MMG.parameter("yv")
    assert with_hull_priors([NORRBIN], wide) == ([NORRBIN], ())


def test_a_height_follows_from_area_and_aspect_ratio() -> None:
    assert HULL.form(200.0).rudder_height == pytest.approx((36.0 * 1.8) ** 0.5 / 200.0)
    assert replace(HULL, rudder_aspect_ratio=None).form(200.0).rudder_height is None


def log_with(**conditions: str) -> TrialLog:
    return TrialLog("a log", (), {f"condition.{name}": text for name, text in conditions.items()})


def test_a_hull_that_a_log_states_holds_where_the_file_has_none() -> None:
    stated = log_with(
        breadth="32 m", draught_forward="9.5 m", draught_aft="10.5 m", displacement="46000 t",
        loading="full load",
    )  # fmt: skip
    bare = replace(SHIP, hull=Hull())
    ship = with_stated_hull(bare, [log_with(), stated])
    assert ship is not None
    assert ship.hull == Hull(
        breadth=32.0, draught_forward=9.5, draught_aft=10.5, displacement=46_000.0
    )
    assert with_stated_hull(SHIP, [stated]) is SHIP
    assert with_stated_hull(bare, [log_with()]) == bare
    assert with_stated_hull(None, [stated]) is None


@pytest.mark.parametrize(
    ("conditions", "hull"),
    [
        ({"breadth": "wide"}, Hull()),
        ({"breadth": "0 m"}, Hull()),
        ({"breadth": "300 m"}, Hull()),  # more than the length
        ({"draught_aft": "9 m", "breadth": "32 m"}, Hull(breadth=32.0)),
        ({"block_coefficient": "0.7", "displacement": "9 t"}, Hull(block_coefficient=0.7)),
    ],
)
def test_conditions_that_are_no_hull_are_not_used(conditions: dict[str, str], hull: Hull) -> None:
    ship = with_stated_hull(replace(SHIP, hull=Hull()), [log_with(**conditions)])
    assert ship is not None
    assert ship.hull == hull
