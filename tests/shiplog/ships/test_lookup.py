"""Ship models by name: found, listed, pickled and copied."""

import pickle
import subprocess
import sys
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from extensions import declare

from shiplog import ShiplogError, Signals, UsageError
from shiplog.ships import GROUP, Model, loadable_models, model_names, ship_model
from shiplog.ships.path import input_path


def test_unknown_models_and_parameters_are_rejected_with_the_nearest_name() -> None:
    with pytest.raises(UsageError, match=r"did you mean 'nomoto'.*; installed: burylin, "):
        ship_model("nomotto")
    with pytest.raises(UsageError, match=r"no parameter 'b4'.*it has a, b1"):
        ship_model("burylin").parameter("b4")


def test_models_are_named_without_numba() -> None:
    code = "import shiplog.ships as s, sys; print(len(s.model_names()), 'numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["8", "False"]


def test_all_models_come_from_the_simplest_to_the_richest() -> None:
    models, warnings = loadable_models()
    free = [sum(not p.fixed for p in model.parameters) for model in models]
    assert free == sorted(free)
    assert sorted(model.name for model in models) == list(model_names())
    assert not warnings


def test_a_broken_package_is_reported_and_leaves_the_other_models(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    declare(tmp_path, "fastships", GROUP, fast="no_such_module:FAST")
    monkeypatch.syspath_prepend(tmp_path)
    assert "fast" in model_names()
    assert ship_model("nomoto").name == "nomoto"
    with pytest.raises(ShiplogError, match=r"'fast' cannot be loaded.*the package fastships"):
        ship_model("fast")
    models, warnings = loadable_models()
    assert len(models) == 8
    assert len(warnings) == 1
    assert "fastships" in warnings[0]


def run_of(model: Model) -> np.ndarray:
    rudder = np.interp(np.arange(60.0), [5.0, 15.0], [0.0, 0.2])
    path = input_path(Signals(0, 1.0, {"rudder": rudder, "rpm": np.full(60, 80.0)}))
    scale = model.scale(160.0, 8.0, 80.0)
    state = [8.0 / scale.speed if value.channel == "speed" else 0.0 for value in model.state]
    return model.simulate(model.start_values(), np.array(state), path, 60, scale=scale)


def unpickled(data: bytes) -> Model:
    model: Model = pickle.loads(data)  # noqa: S301 - our own
    return model


@pytest.mark.parametrize("name", model_names())
def test_a_pickled_or_copied_model_is_equal_and_simulates_the_same(name: str) -> None:
    model = ship_model(name)
    for other in (unpickled(pickle.dumps(model)), deepcopy(model)):
        assert other == model
        assert other is not model
        assert hash(other) == hash(model)
        assert other.names == model.names
        np.testing.assert_array_equal(run_of(other), run_of(model))


@pytest.mark.parametrize("name", model_names())
def test_a_changed_model_is_pickled_with_its_changes(name: str) -> None:
    model = ship_model(name)
    first = replace(model.parameters[0], prior_std=0.1)
    changed = replace(model, parameters=(first, *model.parameters[1:]))
    assert unpickled(pickle.dumps(changed)) == changed != model


def test_another_process_can_use_a_pickled_model(tmp_path: Path) -> None:
    (tmp_path / "model.pickle").write_bytes(pickle.dumps(ship_model("nomoto")))
    code = (
        "import pickle, sys; from pathlib import Path;"
        "model = pickle.loads(Path(sys.argv[1]).read_bytes());"
        "from shiplog.ships import ship_model; print(model == ship_model('nomoto'))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "model.pickle"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == "True"


def test_a_model_whose_function_has_no_name_cannot_be_pickled() -> None:
    model = replace(ship_model("nomoto"), compiled=lambda *_: np.zeros((1, 4), complex))
    with pytest.raises(pickle.PicklingError, match="its compiled function is not <lambda> of the"):
        pickle.dumps(model)
