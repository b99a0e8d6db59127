import pytest

from analysis.linear.system_file import load_system, parse_system
from shiplog.errors import SystemFileError

BAD = """
nam = "x"
step_secs = -1
[plant]
model = "rol"
[outputs.roll_rate]
unit = "deg/sec"
std = -1.0
[inputs.moment]
chanel = "rudder"
[noise]
process = { rol = 1.0 }
[[disturbance]]
model = "constnt"
[[coloured]]
name = "gust"
spectrum = "dryden"
[method]
name = "kalmann"
[initial]
state = 3
"""


@pytest.mark.parametrize(
    "text",
    [
        "A = [[1, 2], [3]]",
        "A = [['1', 2], [3, 4]]",
        "A = [[1, 2], [3, 4]]\n[method]\nname = 'luenburger'\nfrequency = 1",
    ],
)
def test_an_error_is_reported_without_those_that_follow_from_it(text: str) -> None:
    plant = "[plant]\nstates = { a = 'm', b = 'm' }\nB = [[1], [0]]\n"
    signals = "\n[inputs.u]\n[outputs.a]\n[outputs.b]\n[noise]\nprocess = { b = 1 }"
    with pytest.raises(SystemFileError, match=r"^one error"):
        parse_system(plant + text + signals, "bad.toml")


def test_all_errors_of_a_file_are_reported_at_once_with_the_nearest_name() -> None:
    with pytest.raises(SystemFileError) as error:
        parse_system(BAD, "bad.toml")
    message = str(error.value)
    for expected in (
        "unknown key 'nam', did you mean 'name'?",
        "step_secs must be positive, got -1",
        "plant.model must be one of roll, yaw, surge, rigid-body, got 'rol', did you mean 'roll'?",
        "outputs.roll_rate.unit = 'deg/sec' is not known, did you mean 'deg/s'?",
        "outputs.roll_rate.std must be positive",
        "unknown key 'inputs.moment.chanel', did you mean 'channel'?",
        "noise.process names 'rol'",
        "[disturbance 1] lacks name",
        "disturbance 1.model must be one of constant, ramp",
        "disturbance 1 acts on nothing",
        "[coloured 1] lacks std",
        "[coloured 1] lacks length",
        "coloured 1 needs on_state or on_sensor",
        "method.name must be one of kalman, quality",
        "did you mean 'kalman'?",
        "initial.state must have a number for each name",
    ):
        assert expected in message, expected
    assert "\n" not in message
    assert message.endswith(": bad.toml")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "[plant] needs a square A, or num and den, or model"),
        ("[plant]\nA = [[1, 2]]", "a square A"),
        ("[plant]\nA = [[1, 2], [3]]", "rows of numbers, all of equal length"),
        (
            "[plant]\nmodel = 'surge'\nT = 9\nK = 1\n[outputs.speed]\n[inputs.rpm]\nunit = 'Hz'",
            "inputs.rpm.unit is Hz, the plant takes rpm; omit the unit, or give the scale",
        ),
        (
            "plant = { model = 'yaw', vessel = 'table1' }\n[schedule.speed]\nunit = 'kn'",
            "schedule.speed.unit is kn, the plant takes m/s",
        ),
        ("[plant]\nA = [[nan]]", "list of rows"),
        ("[plant]\nA = [[1]]\nB = [[1], [2]]", "plant.B has 2 × 1 numbers, expected 1 × 1"),
        ("[plant]\nnum = [1, 2]\nden = [1]", "plant.den must be longer"),
        (
            "[plant]\nA = [[0]]\n[outputs.x]",
            "outputs.x is no state of the plant, did you mean 'x1'?",
        ),
        ("[plant]\nA = [[0]]\nC = [[1], [1]]\n[outputs.x]", "C has 2 rows"),
        ("[plant]\nA = [[0]]\nB = [[1]]\n[outputs.x1]", "B has 1 columns, but there are 0"),
        ("[plant]\nmodel = 'roll'\n[outputs.roll_rate]", "[plant] lacks inertia"),
        (
            "[plant]\nmodel = 'yaw'\nvessel = 'no.toml'\n[outputs.yaw_rate]",
            "plant.vessel: no vessel",
        ),
        ("[plant]\nA = [[0]]\n[outputs.x1]\n[method]\nname='multi-level'", "[method] lacks poles"),
        (
            "[plant]\nA = [[0]]\n[outputs.x1]\n[method]\nname='multi-level'\npoles=[0.1]",
            "negative real parts",
        ),
        (
            "[plant]\nA = [[0]]\n[outputs.x1]\n[regulator]\nP={x1=1}",
            "[regulator] needs [inputs.NAME]",
        ),
        ("[plant]\nA = [[0]]\n[outputs.x1]\n[noise]\nQ=[[1, 2], [0, 1]]", "noise.Q must have 1"),
        (
            (
                "[plant]\nA = [[0]]\n[outputs.x1]\n[[coloured]]\nname='c'\nspectrum='rational'\n"
                "num=[1]\nden=[1, -1]\non_state={x1=1}"
            ),
            "stable filter",
        ),
        (
            (
                "[plant]\nA = [[0]]\n[outputs.x1]\n[[disturbance]]\nname='x1'\nmodel='ramp'\n"
                "on_state={x1=1}"
            ),
            "'x1' is used more than once",
        ),
        ("[plant\n", "not a TOML file"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(text: str, expected: str) -> None:
    with pytest.raises(SystemFileError) as error:
        parse_system(text, "bad.toml")
    assert expected in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_file_is_named() -> None:
    with pytest.raises(SystemFileError, match=r"cannot read the system file .*: none.toml"):
        load_system("none.toml")
