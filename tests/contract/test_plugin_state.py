"""The pytest plugin in third-party tests, which do not touch the tester's own journal."""

import os
import subprocess
import sys

import pytest

import robolink
from robolink import ToolOffset

SERVED = """
import re
import socket

def test_the_served_one_answers(epson_tcp):
    host, port = epson_tcp.url.removeprefix("epson+tcp://").split(":")
    with socket.create_connection((host, int(port)), timeout=5) as client:
        client.sendall(b"$Login,\\r\\n")
        assert client.recv(100) == b"#Login,0\\r\\n"
    assert epson_tcp.simulator.seed == 7
    assert re.fullmatch(r"assist\\+tcp://[\\w-]{22}@127\\.0\\.0\\.1:\\d+", epson_tcp.assist)

def test_the_one_in_process_has_a_url(epson_sim):
    from robolink.transport import open_transport
    open_transport(epson_sim.url).close()
    assert epson_sim.simulator.seed == 7

def test_a_crash_leaves_its_marker_to_nobody(epson_tcp, robolink_state):
    import robolink
    from robolink.model import Marker, MarkerKind
    controller = robolink.connect(epson_tcp.url)
    controller.outcomes.begin(Marker("a", MarkerKind.SET, "TLSet 1", "then"))
    controller.close()
    assert (robolink_state / "journal.db").exists()
    from robolink.config import named_plant
    assert named_plant() is None
"""

CUT = """
import pytest
import robolink
from robolink import ToolOffset
from robolink.errors import OutcomeUnknownError
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.faults import PlcFault, PlcFaultAction

folders = []


def cut_in_a_write(url, simulator, fault):
    simulator.faults.add(fault)
    with robolink.connect(url) as controller:
        with pytest.raises(OutcomeUnknownError):
            controller.tools.write(2, ToolOffset(1, 2, 3), expected=None)
    with robolink.connect(url) as controller:
        assert controller.outcomes.open_markers()


def test_a_write_on_a_port_is_cut_in_the_middle(epson_tcp, robolink_state):
    lost = Fault(FaultAction.DISCONNECT, match="TLSet 2, XY")
    cut_in_a_write(epson_tcp.url, epson_tcp.simulator, lost)
    assert [path.name for path in robolink_state.glob("journal.db")] == ["journal.db"]
    folders.append(robolink_state)


@pytest.mark.parametrize("softmotion_sim", ["modbus-tcp"], indirect=True)
def test_a_write_on_a_bus_is_cut_in_the_middle(softmotion_sim, robolink_state):
    lost = PlcFault(PlcFaultAction.DISCONNECT, match="WRITE_TOOL")
    cut_in_a_write(softmotion_sim.url, softmotion_sim.simulator, lost)
    folders.append(robolink_state)


def test_the_next_starts_clean(epson_tcp, robolink_state):
    assert robolink_state not in folders
    assert not list(robolink_state.iterdir())
    with robolink.connect(epson_tcp.url) as controller:
        assert not controller.outcomes.open_markers()
        controller.tools.write(2, ToolOffset(1, 2, 3), expected=None)
"""


PYTEST = "import sys, pytest; sys.exit(pytest.main(sys.argv[1:]))"


@pytest.fixture
def own_folder(tmp_path, monkeypatch):
    """The state folder of the tester."""
    folder = tmp_path / "own"
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(folder))
    monkeypatch.delenv("ROBOLINK_JOURNAL", raising=False)
    return folder


def contents(folder):
    return {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


def test_served_simulators_have_the_seed_and_leave_nothing_in_the_tester_s_own_folder(
    tmp_path, own_folder, monkeypatch
):
    own_folder.mkdir()
    (own_folder / "journal.db").write_bytes(b"precious")
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(own_folder / "journal.db"))
    monkeypatch.setenv("ROBOLINK_PLANT", "postgresql://tester@plant/copies")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))
    before = contents(own_folder)
    (theirs := tmp_path / "theirs").mkdir()
    (theirs / "test_served.py").write_text(SERVED)
    (theirs / "test_cut.py").write_text(CUT)
    # It runs in its own process: the environment when the plugin was loaded is the tester's.
    # Hypothesis, which none of its tests uses, would take as long as all else.
    left_out = ("-p", "no:cacheprovider", "-p", "no:hypothesispytest")
    strict = ("-W", "error", "-W", "ignore::pytest.PytestAssertRewriteWarning")  # it is forked
    command = (sys.executable, "-m", "tests._program", PYTEST, "-q", *left_out, *strict)
    done = subprocess.run(
        [*command, "--robolink-seed", "7"], cwd=theirs, capture_output=True, text=True, check=False
    )
    assert "6 passed in" in done.stdout, done.stdout
    assert contents(own_folder) == before


def test_without_the_fixtures_it_would_be_there(own_folder):
    """Shows that the test above looks in the right place."""
    from robolink_simulators.epson.device import EpsonSimulator
    from robolink_simulators.hosting.streams.epson import serve_tcp

    with serve_tcp(EpsonSimulator()) as host, robolink.connect(host.url) as controller:
        controller.tools.write(2, ToolOffset(1, 2, 3), expected=None)
    assert (own_folder / "journal.db") in contents(own_folder)
