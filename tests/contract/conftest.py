"""The backend matrix: the same checks on the in-process simulator, on a socket, on hardware."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.testkit import media

import robolink
from robolink.transport.opcua import own_certificate as own

SPEED = 40.0
"""Simulated seconds per real second on the socket."""

PSEUDO_TERMINALS = hasattr(os, "openpty")


@dataclass
class Cell:
    """A controller to test against; ``simulator`` is None on hardware."""

    url: str
    simulator: EpsonSimulator | None

    def connect(self, **options):
        return robolink.connect(self.url, **options)


@contextmanager
def served(backend: str, simulator: EpsonSimulator) -> Iterator[Cell]:
    """Offer ``simulator`` on ``backend``."""
    medium = "serial" if backend == "pty" else backend
    clock = None if backend == "sim" else ScaledClock(SPEED)
    with media.served(simulator, medium, clock=clock) as url:
        yield Cell(url, simulator)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Deselect what a serial line has no frame for, and leave most of what is served to soak.

    What a driver makes of an answer is the same on every link. In ``make test`` a test meets a
    socket or a serial line only if it is marked so, or is not run in process.
    """
    asked = {item.nodeid for item in items if not item.get_closest_marker("soak")}
    impossible = []
    for item in items:
        given = getattr(item, "callspec", None)
        link = given and (given.params.get("cell") or given.params.get("serve"))
        if link not in ("tcp", "pty"):
            continue
        if link == "pty" and (item.get_closest_marker("remote_ethernet") or not PSEUDO_TERMINALS):
            impossible.append(item)
        elif not item.get_closest_marker("on_every_link"):
            in_process = re.sub(rf"\b{link}\b", "sim", item.nodeid)
            if link == "pty" or in_process in asked:
                item.add_marker(pytest.mark.soak)
    if impossible:
        config.hook.pytest_deselected(items=impossible)
        items[:] = [item for item in items if item not in impossible]


@pytest.fixture(autouse=True)
def _own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


@pytest.fixture(scope="session")
def drawn_certificate(tmp_path_factory):
    """A certificate of this computer with its key, since a key takes a tenth of a second."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROBOLINK_STATE_DIR", str(tmp_path_factory.mktemp("own")))
        return own.own_certificate().path.read_bytes()


@pytest.fixture
def own_certificate(drawn_certificate, _own_state_folder):
    """Lay it where OPC UA finds this computer's own."""
    path, _ = own.own_files()
    path.parent.mkdir(parents=True, mode=0o700)
    path.touch(mode=0o600)
    path.write_bytes(drawn_certificate)


@pytest.fixture(params=["sim", "tcp", "pty", "hardware"])
def cell(request) -> Iterator[Cell]:
    """A controller with the default options: simulated, served, or real."""
    if request.param == "hardware":
        url = os.environ.get("ROBOLINK_EPSON_URL")
        if not url:
            pytest.skip("no hardware: set ROBOLINK_EPSON_URL to a real controller")
        moves = request.node.get_closest_marker("moves")
        if moves and os.environ.get("ROBOLINK_ALLOW_MOTION") != "1":
            pytest.skip("no motion on hardware: set ROBOLINK_ALLOW_MOTION=1")
        if request.node.get_closest_marker("simulator_only"):
            pytest.skip("needs the simulator's controls")
        yield Cell(url, None)
        return
    with served(request.param, EpsonSimulator(seed=7)) as cell:
        yield cell


@pytest.fixture(params=["sim", "tcp", "pty"])
def serve(request):
    """Returns a function that makes a cell around the test's own simulator."""
    return lambda simulator: served(request.param, simulator)


@pytest.fixture
def options():
    """The class of simulator options, for tests that vary them."""
    return EpsonOptions


@pytest.fixture
def arm(tmp_path, monkeypatch):
    """An EPSON cell with commands, for tests of what is the same on all kinds."""
    from tests.contract._method_cell import method_cell

    with method_cell("epson", tmp_path, monkeypatch) as cell:
        yield cell
