"""A multicast group is heard again after its network adapter was unplugged and plugged in.

The adapter is a virtual one in a network namespace of its own, which Linux lets a process make.
"""

import json
import socket
import subprocess
import sys
import time

import pytest

from recorders.streams.reception_clock import ReceptionClock
from recorders.transports import udp
from recorders.transports.live_stream import LiveStream, StreamState
from recorders.transports.udp import UdpTransport

ADDRESS, GROUP, PORT = "10.9.8.1", "239.192.0.4", 60_004
IN_NAMESPACE = ("unshare", "--map-root-user", "--net")


def _run(*words: str) -> bool:
    try:
        return subprocess.run(words, check=False, capture_output=True).returncode == 0
    except FileNotFoundError:
        return False


def _plug_in() -> None:
    for command in (
        "link add adapter type veth peer name other",
        f"addr add {ADDRESS}/24 dev adapter",
        "link set adapter up",
        "link set other up",
    ):
        assert _run("ip", *command.split())


def _send(text: bytes) -> None:
    with socket.socket(type=socket.SOCK_DGRAM) as sender:
        adapter = socket.inet_aton(ADDRESS)
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, adapter)
        sender.sendto(text, (GROUP, PORT))


def _wait_for(live: LiveStream, state: StreamState) -> None:
    deadline = time.monotonic() + 10
    while live.state is not state and time.monotonic() < deadline:
        time.sleep(0.05)


def unplug_and_plug_in() -> None:
    """Listen while the adapter goes and comes back, and print what was received and reported."""
    udp.REJOIN_SECS = 0.3
    clock = ReceptionClock()
    live = LiveStream(UdpTransport("udp", GROUP, PORT, ADDRESS, clock), clock, "bridge")
    _plug_in()
    live.start()
    _wait_for(live, StreamState.OPEN)
    time.sleep(1.0)  # the membership is verified several times
    _send(b"before")
    assert _run("ip", "link", "del", "adapter")
    _plug_in()
    time.sleep(1.0)
    _send(b"after a moment")
    assert _run("ip", "link", "del", "adapter")
    _wait_for(live, StreamState.LOST)
    _plug_in()
    _wait_for(live, StreamState.OPEN)
    _send(b"after a while")
    time.sleep(0.3)
    live.stop()
    received = [packet.data.decode() for packet in live.take()]
    sys.stdout.write(json.dumps([received, [event.text for event in live.take_events()]]))


@pytest.mark.skipif(sys.platform != "linux", reason="network namespaces are of Linux")
def test_a_group_is_heard_again_when_its_adapter_is_plugged_in_again() -> None:
    if not _run(*IN_NAMESPACE, "ip", "link", "add", "adapter", "type", "veth"):
        pytest.skip("this system lets a process make no virtual network adapter")
    child = [*IN_NAMESPACE, sys.executable, __file__]
    output = subprocess.run(child, check=True, capture_output=True, text=True, timeout=60).stdout
    received, events = json.loads(output)
    assert received == ["before", "after a moment", "after a while"]
    assert events[0].startswith(
        "no connection to udp: No such device; no interface has the address"
    )
    assert events[1].startswith("connected again after a gap of")
    assert len(events) == 2


if __name__ == "__main__":
    unplug_and_plug_in()
