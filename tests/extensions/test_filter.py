"""A filter of another package, as docs/how_to_add_a_filter.md makes it."""

import json
import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace as Values

import numpy as np
import pytest
from extensions import EXTENSIONS, code_blocks, declare, import_from, installed, run_shiplog
from places import PROJECT
from scipy.linalg import solve_discrete_are

from analysis.filters.factory import filter_kind
from analysis.replay.replay import analyse
from shiplog.cli.main import main
from shiplog.vessel.presets import PRESETS

LOG = PROJECT / "sample_data" / "zigzag_20_20.mcap"


@pytest.fixture(scope="module")
def environment(
    tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config
) -> Mapping[str, str]:
    folder = tmp_path_factory.mktemp("broken")
    (folder / "broken.py").write_text("import no_such_module\n", encoding="utf-8")
    declare(folder, "broken", "shiplog.filters", broken="broken:BROKEN")
    return installed("filter", pytestconfig, folder)


@pytest.fixture
def package(environment: Mapping[str, str], monkeypatch: pytest.MonkeyPatch) -> Values:
    """The module of the filter, whose package this process finds for the time of a test."""
    import_from(environment, monkeypatch)
    monkeypatch.delitem(sys.modules, "alpha_beta", raising=False)
    return import_module("alpha_beta")


def test_the_page_shows_the_files_of_the_package() -> None:
    blocks = code_blocks(PROJECT / "docs" / "how_to_add_a_filter.md")
    assert blocks == {
        name: (EXTENSIONS / "filter" / name).read_text(encoding="utf-8")
        for name in ("pyproject.toml", "alpha_beta.py")
    }


def test_gains_and_covariance_are_those_of_the_steady_state_kalman_filter(package: Values) -> None:
    T, ratio, r = 0.5, np.array([1e-3, 0.2]), np.array([1e-8, 1e-2])
    noise = Values(process_ratio=ratio, measurement_std=np.sqrt(r))
    stats = Values(interval_secs=np.full(2, T), first=(0, 0))
    found = package.AlphaBetaFilter(None, noise, stats, None)
    F, G, C = np.array([[1, T], [0, 1]]), np.array([[T**2 / 2], [T]]), np.array([[1.0, 0]])
    for i, bandwidth in enumerate((ratio[0] ** 0.25, ratio[1] ** 0.5)):
        P = solve_discrete_are(F.T, C.T, G @ G.T * (bandwidth**2) ** 2, np.eye(1))
        S = P[0, 0] + 1
        np.testing.assert_allclose([gain[i] for gain in found._gains], P[:, 0] / S, rtol=1e-8)
        stds = np.sqrt(r[i] * np.diag(P - P[:, :1] @ P[:1] / S))
        np.testing.assert_allclose(found._stds[[0, 1] if i == 0 else [3, 4]], stds, rtol=1e-7)
        np.testing.assert_allclose(found._innovation_stds[i], np.sqrt(r[i] * S), rtol=1e-8)


def test_the_command_line_replays_with_the_filter_by_its_name(
    environment: Mapping[str, str], tmp_path: Path
) -> None:
    options = ["--set", "filter.yaw_bandwidth=0.2", "--json", "out.json"]
    done = run_shiplog(environment, tmp_path, "replay", LOG, "--filter", "alpha-beta", *options)
    assert done.returncode == 0, done.stderr
    assert "without effect" not in done.stderr
    assert '"alpha-beta"' in json.dumps(json.loads((tmp_path / "out.json").read_text("utf-8")))


@pytest.mark.usefixtures("package")
def test_a_vessel_file_selects_the_filter_by_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text = f'{PRESETS["table1"].rstrip()}\nkind = "alpha-beta"\n'
    Path("ship.toml").write_text(text, encoding="utf-8")
    assert main(["replay", str(LOG), "--vessel", "ship.toml"]) == 0
    assert "alpha-beta" in capsys.readouterr().out


def test_python_takes_the_filter_itself_or_its_name(package: Values) -> None:
    assert filter_kind("alpha-beta") is package.ALPHA_BETA
    fast = {"filter.yaw_bandwidth": 1.0, "filter.surge_bandwidth": 0.1}
    given = analyse(LOG, filter=package.ALPHA_BETA, settings=fast)
    named = analyse(LOG, filter="alpha-beta", settings=fast)
    assert np.array_equal(given.estimates.states, named.estimates.states)
    assert given.findings.plan.vessel.filter.kind == "alpha-beta"
    extended = analyse(LOG, filter="extended").estimates.states
    assert np.corrcoef(given.estimates.states[:, 0], extended[:, 0])[0, 1] > 0.99


def test_python_takes_a_filter_that_is_not_installed(package: Values) -> None:
    found = analyse(LOG, filter=replace(package.ALPHA_BETA, name="mine"))
    assert found.findings.plan.vessel.filter.chosen == "mine"


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        ("--filter alpha-beta --smooth", 2, "filter.smooth needs a filter with the optimal gain"),
        ("--filter alpha-beta --wave", 2, "filter.wave needs a filter that can model a wave"),
        ("--filter alpha", 2, "filter.kind must be one of alpha-beta, broken, extended"),
        ("--filter broken", 1, "the filter 'broken' cannot be loaded from broken:BROKEN"),
    ],
)
@pytest.mark.usefixtures("package")
def test_a_filter_that_cannot_be_used_is_reported_in_one_line(
    capsys: pytest.CaptureFixture[str], options: str, code: int, message: str
) -> None:
    assert main(["replay", str(LOG), *options.split(), "-o", os.devnull]) == code
    lines = capsys.readouterr().err.splitlines()
    errors = [line for line in lines if not line.startswith("warning:")]
    assert len(errors) == 1
    assert message in errors[0]
