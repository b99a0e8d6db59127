"""Detection of the format of a file or a live stream, by the installed decoders."""

import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from number_format import NUMBERS
from sentences import sentence

from recorders.trial import format_detection
from recorders.trial.format_detection import detect_stream_format
from shiplog.cli.main import main
from shiplog.errors import LogError, ShiplogError, UsageError

SAMPLE = Path(__file__).parents[3] / "sample_data"
DATA = Path(__file__).parents[4] / "shared" / "data"
CANDUMP = b"(1745600961.335462) can0 09F1120D#00102700000000FC"
DELTA = (
    b'{"context":"vessels.self","updates":[{"timestamp":"2026-05-01T00:00:00Z",'
    b'"values":[{"path":"navigation.headingTrue","value":1.0}]}]}'
)


@pytest.fixture
def silent_secs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Listen for a moment only."""
    monkeypatch.setattr(format_detection, "LISTEN_SECS", 0.5)


@pytest.fixture
def sender() -> Iterator[str]:
    """The address to listen at, to which sentences are sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    stop = threading.Event()

    def send() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            while not stop.wait(0.01):
                out.sendto(sentence("HEHDT,1.0,T"), ("127.0.0.1", port))

    thread = threading.Thread(target=send)
    thread.start()
    yield f"udp://127.0.0.1:{port}"
    stop.set()
    thread.join()


@pytest.mark.parametrize(
    ("lines", "name"),
    [
        ([sentence("HEHDT,1.0,T")], "nmea0183"),
        ([sentence("GPGSV,1,1,00")], "nmea0183"),  # of the format, though not used
        ([b"2026-05-01T00:00:00Z " + sentence("HEHDT,1.0,T")], "nmea0183"),
        ([CANDUMP], "nmea2000"),
        ([DELTA], "signalk"),
        ([b"noise", sentence("HEHDT,1.0,T"), sentence("HEHDT,1.1,T")], "nmea0183"),
    ],
)
def test_the_format_of_a_file_is_that_whose_decoder_reads_most_lines(
    tmp_path: Path, lines: list[bytes], name: str
) -> None:
    file = tmp_path / "a.log"
    file.write_bytes(b"\n".join(lines * 10))
    assert detect_stream_format(str(file)) == name


@pytest.mark.skipif(not DATA.is_dir(), reason="the real recordings are not here")
@pytest.mark.parametrize("folder", ["nmea0183", "nmea2000"])
def test_every_recording_has_the_format_of_its_folder(folder: str) -> None:
    files = [file for file in sorted((DATA / folder).iterdir()) if file.suffix != ".md"]
    assert files
    assert {detect_stream_format(str(file)) for file in files} == {folder}


@pytest.mark.parametrize("name", ["bridge.csv", "ships.toml"])
def test_a_file_of_no_format_is_refused_with_what_to_write(name: str, tmp_path: Path) -> None:
    file = SAMPLE / name
    if not file.is_file():
        file = tmp_path / name
        file.write_text("length = 320\n")
    with pytest.raises(
        UsageError, match=r"not detected \(no format reads.*record FORMAT .* with one"
    ):
        detect_stream_format(str(file))


def test_packets_that_two_formats_read_have_no_detected_format(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    formats = dict.fromkeys(("one", "another"), NUMBERS)
    monkeypatch.setattr(format_detection, "_loadable_formats", lambda: formats)
    (tmp_path / "a.log").write_text("heading 1.0\n")
    with pytest.raises(UsageError, match=r"not detected \(one and another read most"):
        detect_stream_format(str(tmp_path / "a.log"))


def test_a_file_without_lines_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.log").touch()
    with pytest.raises(UsageError, match="nothing was received"):
        detect_stream_format(str(tmp_path / "empty.log"))
    with pytest.raises(LogError, match="cannot be read"):
        detect_stream_format(str(tmp_path / "none.log"))


def test_the_format_of_a_live_stream_is_detected_from_its_first_packets(sender: str) -> None:
    assert detect_stream_format(sender) == "nmea0183"


@pytest.mark.usefixtures("silent_secs")
def test_a_silent_address_is_refused_with_what_to_write() -> None:
    with pytest.raises(UsageError, match=r"not detected \(nothing was received\); state it: "):
        detect_stream_format("udp://127.0.0.1:39871")


def test_an_address_that_cannot_be_opened_is_named_with_a_remedy() -> None:
    with pytest.raises(
        ShiplogError, match=r"no connection to udp://192\.0\.2\.1:10110: .*ip address"
    ):
        detect_stream_format("udp://192.0.2.1:10110")


def test_a_bus_has_the_only_format_that_opens_it() -> None:
    assert detect_stream_format("can0") == "nmea2000"


def test_a_file_is_recorded_without_a_stated_format(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "ship.mcap"
    assert main(["record", str(SAMPLE / "ship.nmea"), "-o", str(log)]) == 0
    assert "the format is nmea0183: shiplog record nmea0183" in capsys.readouterr().err
    assert log.is_file()
