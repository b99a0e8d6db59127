"""The command line: each verb end to end; each invalid input gives one line and its exit code."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap_files import end_mcap_chunk
from places import KVLCC2, LAYOUTS, PROJECT, SAMPLE_DATA
from stderr_lines import foreign_lines

from recorders.record import record
from recorders.simulated.simulate import SimulatedTrial
from shiplog import Channel, LogWriter, TrialLog, read, write
from shiplog.cli.main import main
from shiplog.cli.verb import ExitCode

OK, FAILURE, USAGE, DATA_LOST, _ = ExitCode


@pytest.fixture(autouse=True)
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("CI", raising=False)  # in CI, references are not updated


@pytest.fixture(scope="module")
def recorded(zigzag: SimulatedTrial, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recorded") / "zigzag.mcap"
    record(zigzag, path)
    return path


def refusal(capsys: pytest.CaptureFixture[str], code: int, *arguments: object) -> str:
    """Run a verb that rejects its input, and return its one line on stderr."""
    before = set(Path.cwd().rglob("*"))
    assert main([str(a) for a in arguments]) == code
    output = capsys.readouterr()
    assert output.out == ""
    lines = output.err.strip().split("\n")
    assert len(lines) == 1, output.err
    assert lines[0].startswith("shiplog: ")
    assert set(Path.cwd().rglob("*")) == before, "a partly written file remains"
    return lines[0]


# ---- the verbs


def test_simulate_replay_check_and_convert_end_to_end(capsys: pytest.CaptureFixture[str]) -> None:
    simulate = "record simulate zigzag-10-10 --seed 5 --duration 200 -o trial.mcap --truth t.mcap"
    assert main(simulate.split()) == OK
    assert "samples of 6 channels" in capsys.readouterr().out
    assert main(["replay", "trial.mcap", "--json", "trial.json"]) == OK
    out = capsys.readouterr().out
    assert "Filter residuals" in out
    assert "Disturbances" in out
    assert "yaw rate [deg/s]" in out
    assert Path("trial.rrd").stat().st_size > 10_000
    assert "coefficients" in json.loads(Path("trial.json").read_text())
    assert main(["check", "trial.mcap"]) == FAILURE
    assert main(["check", "trial.mcap", "--update"]) == OK
    assert main(["check", "trial.mcap"]) == OK
    assert main(["convert", "trial.mcap", "trial.csv"]) == OK
    assert main(["convert", "trial.csv", "again.mcap"]) == OK
    first, again = read("trial.mcap"), read("again.mcap")
    for one, other in zip(first, again, strict=True):
        assert np.array_equal(one.values, other.values)
        assert np.array_equal(one.measured_ns, other.measured_ns)
        assert np.array_equal(one.received_ns, other.received_ns)
    assert first.vessel_toml == again.vessel_toml


def test_json_on_stdout_is_the_only_output_there(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", str(recorded), "--json", "-", "-o", "z.rrd"]) == OK
    output = capsys.readouterr()
    assert json.loads(output.out)["residuals"]["speed"]["white"] is False
    assert "NOT white" in output.err


def test_a_changed_replay_fails_the_check_and_is_overlaid_on_its_reference(
    recorded: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    log = read(recorded)
    write(log, "z.mcap")
    assert main(["check", "z.mcap", "--update"]) == OK
    changed = tuple(
        Channel(c.name, c.source, c.unit, c.measured_ns, c.received_ns, c.values + 1e-6)
        if c.name == "speed"
        else c
        for c in log
    )
    write(TrialLog("z", changed, {}, log.vessel_toml), "z.mcap")
    capfd.readouterr()
    assert main(["check", "z.mcap", "--json", "z.json"]) == FAILURE
    output = capfd.readouterr()
    assert foreign_lines(output.err) == []
    lines = output.out.split("\n")
    assert lines[1].startswith("  /speed/measured: largest difference 1e-06")
    assert Path("z.check.rrd").exists()
    assert json.loads(Path("z.json").read_text())[0]["ok"] is False


def test_references_are_not_updated_in_ci(
    recorded: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CI", "true")
    assert "not updated in CI" in refusal(capsys, USAGE, "check", recorded, "--update")


def test_info_lists_the_contents_of_a_log(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", str(recorded)]) == OK
    out = capsys.readouterr().out
    assert "/rudder/simulated" in out
    assert "turns the bow to starboard" in out
    assert "vessel.toml: attached" in out


def test_a_gust_and_a_wave_are_simulated() -> None:
    simulate = "record simulate turning-circle --duration 60 --noise none -o g.mcap --truth t.mcap"
    assert main([*simulate.split(), "--gust=-2@20+10", "--wave=0.5@8"]) == OK
    moment = read("t.mcap")["yaw_disturbance"].values
    assert moment[:160].mean() == pytest.approx(0, abs=2e-9)
    assert moment[200:300].mean() < -1e-6
    assert np.ptp(moment[400:]) > 2e-7


def test_random_forcing_is_given_in_degrees_and_millimetres() -> None:
    simulate = "record simulate pull-out --duration 900 --noise none -o u.mcap --truth t.mcap"
    assert main([*simulate.split(), "--random-forcing", "0.5,8"]) == OK
    force = read("t.mcap")["surge_disturbance"].values[:9000].reshape(-1, 10).mean(axis=1)
    assert force.std() == pytest.approx(8e-3, rel=0.1)
    both = read("t.mcap")["yaw_disturbance"].values
    assert main([*simulate.split(), "--random-forcing=0.5"]) == OK
    assert np.array_equal(read("t.mcap")["yaw_disturbance"].values, both)
    assert not read("t.mcap")["surge_disturbance"].values.any()


def test_sensor_spikes_are_simulated() -> None:
    simulate = "record simulate spiral --duration 900 --noise none -o {} {}"
    spikes = "--sensor yaw_rate.spikes=0.01 --sensor yaw_rate.spike_size=0.05"
    assert main(simulate.format("a.mcap", "").split()) == OK
    assert main(simulate.format("b.mcap", spikes).split()) == OK
    difference = read("b.mcap")["yaw_rate"].values - read("a.mcap")["yaw_rate"].values
    assert np.count_nonzero(difference) == pytest.approx(90, abs=40)
    assert np.abs(difference[difference != 0]) == pytest.approx(0.05)


def test_an_unfinished_log_is_replayed_with_a_warning(
    zigzag: SimulatedTrial, capsys: pytest.CaptureFixture[str]
) -> None:
    writer = LogWriter("cut.mcap", vessel_toml=zigzag.vessel_toml)
    writer.write(*zigzag.channels)
    writer.flush()
    assert main(["replay", "cut.mcap"]) == OK
    assert "not finished" in capsys.readouterr().err
    writer.close()


def test_a_damaged_log_is_replayed_and_lost_data_are_reported(
    zigzag: SimulatedTrial, capsys: pytest.CaptureFixture[str]
) -> None:
    writer = LogWriter("bad.mcap", vessel_toml=zigzag.vessel_toml)
    for chunk in zigzag.chunks():
        for start in range(0, 5001, 1000):
            cut = slice(start, start + 1000)
            writer.write(
                *(
                    Channel(
                        c.name, c.source, c.unit, c.measured_ns[cut], c.received_ns[cut],
                        c.values[cut], c.fields,
                    )
                    for c in chunk
                )
            )  # fmt: skip
            end_mcap_chunk(writer)
    writer.close()
    data = bytearray(Path("bad.mcap").read_bytes())
    data[len(data) // 2] ^= 0x14
    Path("bad.mcap").write_bytes(data)
    assert main(["replay", "bad.mcap"]) == DATA_LOST
    assert "damaged" in capsys.readouterr().err


RUNS = sorted(KVLCC2.glob("*/*.dat"))


@pytest.mark.skipif(not RUNS, reason="the SIMMAN data are not in ../shared/data/kvlcc2")
@pytest.mark.parametrize("run", RUNS, ids=lambda run: run.stem)
def test_every_kvlcc2_run_is_converted_and_replayed_to_files_that_rerun_accepts(
    run: Path,
) -> None:
    layout = LAYOUTS / f"simman_{run.parent.name}.toml"
    assert main(["convert", str(run), "run.mcap", "--layout", str(layout)]) == OK
    assert main(["replay", "run.mcap", "-o", "run.rrd", "--json", "run.json"]) == OK
    rerun = Path(sys.executable).with_name("rerun")
    for check in (["rrd", "verify", "run.rrd"], ["mcap", "check", "run.mcap"]):
        done = subprocess.run([rerun, *check], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    assert json.loads(Path("run.json").read_text())["model"]["origin"].startswith("first model")


# ---- invalid input


@pytest.mark.parametrize("verb", ["replay", "info", "check"])
def test_a_file_that_is_not_a_log_is_rejected_in_one_line(
    verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("text.mcap").write_text("t,r\n0,1\n")
    Path("empty.mcap").touch()
    Path("folder.mcap").mkdir()
    for name, message in (
        ("text.mcap", "not an MCAP file"),
        ("empty.mcap", "is empty"),
        ("missing.mcap", "no such file"),
    ):
        if verb == "check" and name != "missing.mcap":
            assert main(["check", name]) == FAILURE
            assert message in capsys.readouterr().out
        else:
            assert message in refusal(capsys, FAILURE, verb, name)


def write_broken(name: str, broken: Channel | None, log: TrialLog) -> None:
    channels = tuple(c for c in (broken if c.name == name else c for c in log) if c is not None)
    write(TrialLog("x", channels, {}, log.vessel_toml), "x.mcap")


def test_a_log_without_a_required_channel_is_rejected(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_broken("rudder", None, read(recorded))
    line = refusal(capsys, FAILURE, "replay", "x.mcap")
    assert "no channel 'rudder' in x.mcap; it has heading, position, rpm, speed, yaw_rate" in line


def test_a_channel_of_one_sample_is_rejected(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = read(recorded)
    c = log["speed"]
    one = Channel(c.name, c.source, c.unit, c.measured_ns[:1], c.received_ns[:1], c.values[:1])
    write_broken("speed", one, log)
    assert "one sample" in refusal(capsys, FAILURE, "replay", "x.mcap")


def test_decreasing_time_stamps_are_rejected_and_the_remedy_works(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = read(recorded)
    c = log["yaw_rate"]
    back = Channel(c.name, c.source, c.unit, c.measured_ns[::-1], c.received_ns, c.values[::-1])
    write_broken("yaw_rate", back, log)
    line = refusal(capsys, FAILURE, "replay", "x.mcap")
    assert "backwards" in line
    assert "shiplog convert" in line
    assert main(["convert", "x.mcap", "sorted.mcap"]) == OK
    assert main(["replay", "sorted.mcap"]) == OK


def test_an_infinite_value_is_rejected(recorded: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = read(recorded)
    c = log["yaw_rate"]
    values = c.values.copy()
    values[7] = np.inf
    write_broken(
        "yaw_rate", Channel(c.name, c.source, c.unit, c.measured_ns, c.received_ns, values), log
    )
    assert "infinit" in refusal(capsys, FAILURE, "replay", "x.mcap")


def test_an_unknown_unit_is_rejected(capsys: pytest.CaptureFixture[str]) -> None:
    Path("run.txt").write_text("0 1\n1 2\n")
    Path("layout.toml").write_text(
        'delimiter = "whitespace"\n[time]\ncolumn = 1\nunit = "s"\n'
        '[speed]\ncolumn = 2\nunit = "knot"\n'
    )
    line = refusal(capsys, FAILURE, "convert", "run.txt", "o.mcap", "--layout", "layout.toml")
    assert "'knot'" in line


def test_all_errors_of_a_vessel_file_are_reported_at_once(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (PROJECT / "sample_data" / "vessels" / "table1.toml").read_text()
    text = text.replace("T1 = 150.0", "T1 = -150.0").replace("alpha1", "alfa1")
    Path("bad.toml").write_text(text.replace("h = 0.0004", "h = nan"))
    for arguments in (
        ["replay", recorded, "--vessel", "bad.toml"],
        ["record", "simulate", "spiral", "--vessel", "bad.toml", "-o", "x.mcap"],
    ):
        line = refusal(capsys, FAILURE, *arguments)
        for error in ("T1 must be positive", "alfa1", "h must be finite"):
            assert error in line


@pytest.mark.parametrize("output", ["missing/z.rrd", "."])
def test_an_unwritable_output_is_rejected(
    recorded: Path, capsys: pytest.CaptureFixture[str], output: str
) -> None:
    assert "cannot write" in refusal(capsys, FAILURE, "replay", recorded, "-o", output)


@pytest.mark.parametrize(
    "arguments",
    [
        "record simulate zigzg-20-20 -o x.mcap",
        "record simulate spiral --duration -5 -o x.mcap",
        "record simulate spiral --noise pink -o x.mcap",
        "record simulate spiral --sensor yaw_rate.bias -o x.mcap",
        "record simulate spiral --sensor yawrate.bias=1 -o x.mcap",
        "record simulate spiral --gust much -o x.mcap",
        "record simulate spiral --wave 1@0 -o x.mcap",
        "record simulate spiral --gust=2@-5 -o x.mcap",
        "record simulate spiral --gust=2@1e9 -o x.mcap",
        "record simulate spiral --gust=2@10+-3 -o x.mcap",
        "record simulate spiral --random-forcing much -o x.mcap",
        "record simulate spiral --random-forcing=0.2, -o x.mcap",
        "record simulate spiral --random-forcing=0.2,5,1 -o x.mcap",
        "record simulate spiral --random-forcing= -o x.mcap",
        "record simulate spiral --random-forcing=-0.2 -o x.mcap",
        "record simulate spiral --random-forcing=0.2,-5 -o x.mcap",
        "record simulate spiral --random-forcing=nan -o x.mcap",
        "record simulate spiral --random-forcing=1e999 -o x.mcap",
        "record simulate spiral --sensor yaw_rate.spikes=2 -o x.mcap",
        "record simulate spiral --sensor yaw_rate.spikes=0.1 -o x.mcap",
        "record simulate spiral --seed=-1 -o x.mcap",
        "record simulate spiral --duration 1e12 -o x.mcap",
        "record simulate spiral --sensor yaw_rate.rate_hz=1e9 -o x.mcap",
        "record simulate zigzag-20-400 -o x.mcap",
        "replay x.mcap --source speed",
        "replay x.mcap --sensor-delay heading",
        "identify x.mcap --sensor-delay heading=late",
        "replay x.mcap --sensor-delay heading=1.2,",
        "convert x.mcap x.xlsx",
    ],
)
def test_an_invalid_request_is_a_usage_error_in_one_line(
    capsys: pytest.CaptureFixture[str], arguments: str
) -> None:
    refusal(capsys, USAGE, *arguments.split())


@pytest.mark.parametrize(
    "arguments",
    [
        "replay LOG -o LOG",
        "replay LOG --json LOG",
        "replay LOG -o z.rrd --json z.rrd",
        "info LOG --json LOG",
        "convert LOG LOG",
        "check LOG --json LOG",
        "record simulate spiral -o z.mcap --truth z.mcap",
        "record simulate spiral --vessel LOG -o LOG",
    ],
)
def test_no_output_is_written_over_a_log_or_another_output(
    recorded: Path, capsys: pytest.CaptureFixture[str], arguments: str
) -> None:
    before = recorded.read_bytes()
    refusal(capsys, USAGE, *arguments.replace("LOG", str(recorded)).split())
    assert recorded.read_bytes() == before


def test_a_device_file_is_written_to_and_not_replaced(recorded: Path) -> None:
    assert main(["info", str(recorded), "--json", "/dev/null"]) == OK
    assert Path("/dev/null").is_char_device()


def test_damage_is_reported_even_if_the_replay_then_fails(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = bytearray(recorded.read_bytes())
    data[len(data) // 2] ^= 0x14
    Path("bad.mcap").write_bytes(data)
    code = main(["replay", "bad.mcap"])
    lines = capsys.readouterr().err.split("\n")
    assert code in (FAILURE, DATA_LOST)
    assert lines[0].startswith("warning: ")
    assert "damage" in lines[0]


def test_another_source_can_be_chosen(recorded: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = read(recorded)
    c = log["speed"]
    dead = Channel(c.name, "dead", c.unit, c.measured_ns, c.received_ns, 0 * c.values)
    write(TrialLog("x", (dead, *log), {}, log.vessel_toml), "x.mcap")
    assert main(["replay", "x.mcap"]) == OK
    warnings = capsys.readouterr().err
    assert "simulated is used (the others are constant or not measured)" in warnings
    assert "dead is constant at 0 kn" in warnings
    assert "/speed/dead: constant throughout the log" not in warnings
    assert main(["replay", "x.mcap", "--source", "speed=dead"]) == OK
    warnings = capsys.readouterr().err
    assert "/speed/dead: constant throughout the log" in warnings
    assert "2 sources" not in warnings
    assert "no source 'doppler' of 'speed' in x.mcap; it has dead, simulated" in refusal(
        capsys, FAILURE, "replay", "x.mcap", "--source", "speed=doppler"
    )


def test_an_interrupted_recording_is_not_overwritten(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("k.mcap.part").write_bytes(b"hours of trial")
    simulate = "record simulate spiral --duration 20 -o k.mcap"
    assert "an unfinished recording lies there" in refusal(capsys, FAILURE, *simulate.split())
    assert Path("k.mcap.part").read_bytes() == b"hours of trial"


def test_lost_data_set_the_exit_code_of_every_verb(recorded: Path) -> None:
    data = recorded.read_bytes()
    Path("cut.mcap").write_bytes(data[: len(data) * 3 // 4])
    assert main(["info", "cut.mcap", "--json", "-"]) == DATA_LOST
    assert main(["replay", "cut.mcap"]) == DATA_LOST
    assert main(["check", "cut.mcap", "--update"]) == FAILURE
    assert not Path("cut.ref.mcap").exists()


def test_convert_recovers_an_interrupted_recording(
    zigzag: SimulatedTrial, capsys: pytest.CaptureFixture[str]
) -> None:
    writer = LogWriter("k.mcap.part", vessel_toml=zigzag.vessel_toml)
    writer.write(*zigzag.channels)
    writer.flush()
    assert main(["convert", "k.mcap.part", "rescued.mcap"]) == OK
    assert "not finished" in capsys.readouterr().err
    writer.close()
    assert read("rescued.mcap").warnings == ()


def test_a_reversed_rudder_sign_is_reported_when_a_table_is_converted(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = read(recorded)
    rows = zip(*(log[name].values for name in ("yaw_rate", "rudder", "speed")), strict=True)
    lines = [f"{0.1 * k} {r} {-delta} {v}" for k, (r, delta, v) in enumerate(rows)]
    Path("run.txt").write_text("\n".join(lines))
    columns = (("time", "s"), ("yaw_rate", "rad/s"), ("rudder", "rad"), ("speed", "m/s"))
    layout = 'delimiter = "whitespace"\n'
    for i, (name, unit) in enumerate(columns, start=1):
        layout += f'[{name}]\ncolumn = {i}\nunit = "{unit}"\n'
    Path("layout.toml").write_text(layout)
    assert main(["convert", "run.txt", "run.mcap", "--layout", "layout.toml"]) == OK
    assert "its sign is reversed" in capsys.readouterr().err


def test_without_a_verb_the_help_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == USAGE
    assert "replay" in capsys.readouterr().err


def test_heavy_libraries_are_imported_only_by_verbs_that_need_them(recorded: Path) -> None:
    code = (
        "import sys; from shiplog.cli.main import main\n"
        "for arguments in (['--help'], sys.argv[1:], ['replay', '-h'], ['identify', '-h']):\n"
        "    try: main(arguments)\n"
        "    except SystemExit: pass\n"
        "    print({'rerun', 'control', 'pandas', 'numba', 'scipy'} & set(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "info", str(recorded)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.splitlines().count("set()") == 4, done.stdout


def test_a_folder_that_shadows_a_package_of_shiplog_is_named(recorded: Path) -> None:
    Path("analysis").mkdir()
    Path("analysis/__init__.py").touch()
    done = subprocess.run(
        [sys.executable, "-m", "shiplog", "replay", str(recorded)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == FAILURE
    assert "another package named 'analysis' shadows shiplog's own" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_review_is_rejected_as_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    message = refusal(capsys, USAGE, "replay", "trial.rrd")
    assert "a review, not a log; open it with: rerun trial.rrd" in message


@pytest.mark.parametrize(
    ("arguments", "suffix"),
    [
        ("record simulate zigzag-20-20 --duration 10 -o trial.csv", ".mcap"),
        ("replay trial.mcap -o review.txt", ".rrd"),
    ],
)
def test_an_output_with_a_wrong_suffix_is_rejected(
    capsys: pytest.CaptureFixture[str], arguments: str, suffix: str
) -> None:
    message = refusal(capsys, USAGE, *arguments.split())
    assert f"the output is a {suffix} file; give it a name that ends so" in message


# ---- identify


@pytest.fixture(scope="module")
def two_runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    folder = tmp_path_factory.mktemp("two_runs")
    paths = []
    for seed, manoeuvre in enumerate(("zigzag-20-20", "turning-circle-35")):
        path = str(folder / f"{manoeuvre}.mcap")
        simulate = f"record simulate {manoeuvre} --seed {seed} --duration 400 -o {path}"
        assert main(simulate.split()) == OK
        paths.append(path)
    return paths[0], paths[1]


def test_a_ship_is_identified_validated_written_simulated_and_replayed(
    two_runs: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    zigzag, circle = two_runs
    capsys.readouterr()
    arguments = ["--fix", "T3=0.5", "--validate", circle, "-o", "ship.toml", "--json", "f.json"]
    assert main(["identify", zigzag, *arguments]) == OK
    output = capsys.readouterr()
    assert "the paper's model, b1 = -d and e = T3 d" in output.out
    assert "tactical diameter [m]" in output.out
    assert "vessel file: ship.toml" in output.err
    result = json.loads(Path("f.json").read_text())
    assert result["parameters"]["d"]["value"] == pytest.approx(1 / 7500, rel=3e-3)
    assert result["fixed"]["T3"] == 0.5
    (validation,) = result["validation"]
    assert validation["rms"]["yaw_rate"] < np.radians(0.02)
    simulate = "record simulate zigzag-20-20 --vessel ship.toml --duration 200 -o again.mcap"
    assert main(simulate.split()) == OK
    assert main(["replay", zigzag, "--vessel", "ship.toml", "-o", "r.rrd"]) == OK
    assert "identified (given)" in capsys.readouterr().out


@pytest.mark.usefixtures("fit_alone")
def test_a_ship_of_another_model_is_identified_written_simulated_and_replayed(
    two_runs: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", *two_runs, "--model", "norrbin", "-o", "ship.toml"]) == OK
    assert 'name = "norrbin"' in Path("ship.toml").read_text(encoding="utf-8")
    sway = "--sensor sway.white=0.05 --gust 2@50+50"
    simulate = (
        f"record simulate zigzag-10-10 --vessel ship.toml --duration 200 {sway} -o again.mcap"
    )
    assert main(simulate.split()) == OK
    assert main(["replay", "again.mcap", "-o", "r.rrd"]) == OK
    assert "identified (attached to the log)" in capsys.readouterr().out
    alone = Path("ship.toml").read_text(encoding="utf-8").partition("[yaw]")[0]
    Path("alone.toml").write_text(alone, encoding="utf-8")
    assert main(["replay", "again.mcap", "--vessel", "alone.toml", "-o", "r.rrd"]) == OK
    output = capsys.readouterr()
    assert "first model, fitted to this log" in output.out
    assert "has only a model 'norrbin'" in output.err


@pytest.mark.parametrize(
    ("code", "arguments", "message"),
    [
        (USAGE, "Z Z", "named twice"),
        (USAGE, "Z --validate Z", "both fitted and used for validation"),
        (USAGE, "Z --fix T3", "--fix takes NAME=VALUE, such as T3=0.5"),
        (USAGE, "Z --fix T4=1", "no parameter 'T4'; it has a, b1"),
        (USAGE, "Z --model burylon", "did you mean 'burylin'?"),
        (USAGE, "Z --model auto", "give two logs or more, or name the model"),
        (USAGE, "Z -o x.txt", "is a .toml file"),
        (USAGE, "Z --json Z", "the same file is named twice"),
        (FAILURE, "Z none.mcap", "no such file: none.mcap"),
        (FAILURE, "Z --vessel none.toml", "no vessel file and no preset"),
        (FAILURE, "Z -o none/x.toml", "there is no folder"),
    ],
)
def test_an_invalid_request_to_identify_is_rejected_in_one_line(
    two_runs: tuple[str, str], capsys: pytest.CaptureFixture[str],
    code: int, arguments: str, message: str,
) -> None:  # fmt: skip
    capsys.readouterr()
    words = [two_runs[0] if word == "Z" else word for word in arguments.split()]
    assert message in refusal(capsys, code, "identify", *words)


def test_short_and_straight_runs_are_rejected_by_identify(
    capsys: pytest.CaptureFixture[str],
) -> None:
    main(["record", "simulate", "zigzag-20-20", "--duration", "10", "-o", "short.mcap"])
    main(["record", "simulate", "turning-circle-1", "--duration", "200", "-o", "straight.mcap"])
    capsys.readouterr()
    assert "too short to identify a ship" in refusal(capsys, FAILURE, "identify", "short.mcap")
    message = refusal(capsys, FAILURE, "identify", "straight.mcap", "-o", "v.toml")
    assert "the rudder moves by 1.0° in all" in message
    assert not Path("v.toml").exists()


def test_an_unknown_verb_is_rejected_with_the_list_of_verbs(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["inspect", "replay"])
    assert caught.value.code == USAGE
    assert "'record', 'info', 'convert', 'replay', 'identify', 'estimate', 'check'" in (
        capsys.readouterr().err
    )


@pytest.mark.parametrize(
    ("arguments", "usage"),
    [
        ("convert a.mcap b.csv --wde", "shiplog convert "),
        ("record signalk tcp://127.0.0.1:1 -o a.mcap --wde", "shiplog record signalk "),
        ("--wde convert a.mcap b.csv", "shiplog "),
    ],
)
def test_an_unknown_option_is_rejected_with_the_usage_of_its_verb(
    capsys: pytest.CaptureFixture[str], arguments: str, usage: str
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments.split())
    assert caught.value.code == USAGE
    err = capsys.readouterr().err
    assert err.startswith(f"usage: {usage}[-h]")
    assert err.endswith(f"{usage.strip()}: error: unrecognized arguments: --wde\n")


def test_a_replay_imports_no_unneeded_library(recorded: Path) -> None:
    code = (
        "import sys\n"
        f"sys.argv = ['shiplog', 'replay', {str(recorded)!r}, '-o', 'z.rrd', '--json', 'z.json']\n"
        "from shiplog.cli.main import main\n"
        "assert main() == 0\n"
        "slow = ('pandas', 'control', 'scipy.signal', 'scipy.stats', 'scipy.optimize', "
        "'numpy.f2py.f2py2e', 'rich.progress')\n"
        "print([name for name in slow if sys.modules.get(name)], file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip().split("\n")[-1] == "[]"


def test_from_and_to_cut_the_log_in_every_verb(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bounds = ["--from", "100", "--to", "-100"]
    assert main(["convert", str(recorded), "part.mcap", *bounds]) == OK
    assert read("part.mcap").duration_secs == pytest.approx(300, abs=0.2)
    assert "zigzag.mcap" in read("part.mcap").metadata["cut"]
    assert main(["replay", str(recorded), "-o", "r.rrd", "--json", "r.json", *bounds]) == OK
    result = json.loads(Path("r.json").read_text())["log"]
    assert result["duration_secs"] == pytest.approx(300, abs=0.2)
    assert result["name"] == "zigzag.mcap (100 to 400 s)"
    assert "cut" in result["metadata"]
    assert main(["identify", str(recorded), "--json", "i.json", *bounds]) == OK
    (run,) = json.loads(Path("i.json").read_text())["fit"]
    assert run["log"] == "zigzag.mcap (100 to 400 s)"
    assert run["duration_secs"] == pytest.approx(300, abs=1)
    capsys.readouterr()
    assert "has 500.0 s" in refusal(capsys, USAGE, "replay", recorded, "--from", "600")
    assert "no time: 'noon'" in refusal(capsys, USAGE, "identify", recorded, "--to", "noon")


def test_info_of_several_logs_is_a_row_each_and_reports_those_that_cannot_be_read(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("bad.mcap").write_bytes(b"not a log")
    assert main(["info", str(recorded), str(recorded)]) == OK
    out = capsys.readouterr().out
    assert out.count("2026-01-01 00:00:00") == 2
    assert max(map(len, out.splitlines())) <= 80
    assert main(["info", str(recorded), "bad.mcap", "none.mcap", "--json", "i.json"]) == FAILURE
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == 2
    assert all(line.startswith("shiplog: ") for line in errors)
    good, bad, missing = json.loads(Path("i.json").read_text())
    assert good["duration_secs"] == pytest.approx(500, abs=0.1)
    assert "not an MCAP file" in bad["error"]
    assert "no such file" in missing["error"]


def test_info_fits_eighty_columns_without_breaking_its_table(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", str(recorded)]) == OK
    out = capsys.readouterr().out
    assert "(continued)" not in out
    assert max(map(len, out.splitlines())) <= 80


@pytest.mark.usefixtures("fit_alone")
def test_identify_skips_references_and_truths(
    two_runs: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    zigzag, circle = two_runs
    truth = "record simulate zigzag-10-10 --duration 20 -o t.mcap --truth true_motion.mcap"
    assert main(truth.split()) == OK
    reference = SAMPLE_DATA / "zigzag_20_20.ref.mcap"
    capsys.readouterr()
    arguments = [zigzag, str(reference), "--validate", circle, "true_motion.mcap"]
    assert main(["identify", *arguments, "--length", "200", "--json", "f.json"]) == OK
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("skipped")]
    assert [line.split(": ")[1] for line in lines] == [reference.name, "true_motion.mcap"]
    result = json.loads(Path("f.json").read_text())
    assert len(result["fit"]) == len(result["validation"]) == 1
    assert result["scale"]["length_given"]
    assert "give the logs themselves" in refusal(capsys, USAGE, "identify", reference)
