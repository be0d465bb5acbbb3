"""Pytest fixtures that bring a simulated controller; tests connect by URL themselves.

What robolink would keep about a controller in the tester's own state folder (journal, markers,
backups) goes into a folder of the test's own.

Importing this module costs next to nothing: every pytest run of an environment in which
robolink is installed imports it.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

if TYPE_CHECKING:
    from robolink_simulators.epson.device import EpsonSimulator
    from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

_STATE: Final = ("ROBOLINK_STATE_DIR", "ROBOLINK_JOURNAL")
"""What says where the journal, the backups and the like are kept."""

_OF_THE_DEVELOPER: Final = {name: os.environ.get(name) for name in _STATE}


@dataclass(frozen=True, slots=True)
class ServedEpson:
    """A simulated EPSON controller.

    Attributes:
        url: Where to connect to: ``epson+sim://NAME``, or ``epson+tcp://127.0.0.1:PORT``.
        simulator: The device; hold its ``lock`` while touching it.
        assist: ``assist+tcp://TOKEN@127.0.0.1:PORT``; ``None`` without a port.
    """

    url: str
    simulator: "EpsonSimulator"
    assist: str | None = None


@dataclass(frozen=True, slots=True)
class ServedSoftMotion:
    """A simulated SoftMotion PLC with a mailbox.

    Attributes:
        url: Where to connect to.
        simulator: The device; hold its ``lock`` while touching it.
    """

    url: str
    simulator: "SoftMotionSimulator"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--robolink-seed``."""
    group = parser.getgroup("robolink")
    group.addoption(
        "--robolink-seed",
        type=int,
        default=1,
        metavar="N",
        help="seed of the simulated controllers (default: 1)",
    )


def pytest_report_header(config: pytest.Config) -> str:
    """Show the seed, so that a failure can be repeated."""
    return f"robolink: simulated controllers, seed {config.getoption('--robolink-seed')}"


@pytest.fixture
def robolink_state(
    monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Path]:
    """The folder in which robolink keeps journal, markers and backups during this test.

    It is the test's own, so that nothing is left in the developer's journal. A test that named
    one itself, through ROBOLINK_STATE_DIR or ROBOLINK_JOURNAL, keeps it.
    """
    now = {name: os.environ.get(name) for name in _STATE}
    folder = now["ROBOLINK_STATE_DIR"]
    if now == _OF_THE_DEVELOPER or folder is None:
        folder = str(tmp_path_factory.mktemp("robolink-state"))
        monkeypatch.setenv("ROBOLINK_STATE_DIR", folder)
    if now["ROBOLINK_JOURNAL"] == _OF_THE_DEVELOPER["ROBOLINK_JOURNAL"]:
        monkeypatch.delenv("ROBOLINK_JOURNAL", raising=False)
    yield Path(folder)
    if "robolink.journal" in sys.modules:
        from robolink.journal import close_files

        close_files()


@pytest.fixture
def epson_sim(
    request: pytest.FixtureRequest,
    robolink_state: Path,  # noqa: ARG001 - the state of the test, not the tester's
) -> Iterator[ServedEpson]:
    """A simulated EPSON controller in this process, whose time passes only while you wait."""
    from robolink_simulators.epson.device import EpsonSimulator
    from robolink_simulators.hosting.in_process.epson import register, unregister

    simulator = EpsonSimulator(seed=request.config.getoption("--robolink-seed"))
    name = f"pytest-{id(simulator):x}"
    url = register(name, simulator)
    yield ServedEpson(url, simulator)
    unregister(name)


@pytest.fixture
def epson_tcp(
    request: pytest.FixtureRequest,
    robolink_state: Path,  # noqa: ARG001 - the state of the test, not the tester's
) -> Iterator[ServedEpson]:
    """A simulated EPSON controller on a loopback TCP port, with its assist port."""
    from robolink_simulators.assist.port import serve_assist
    from robolink_simulators.cell.clock import ScaledClock
    from robolink_simulators.epson.device import EpsonSimulator
    from robolink_simulators.hosting.streams.epson_tcp import serve_tcp

    simulator = EpsonSimulator(seed=request.config.getoption("--robolink-seed"))
    clock = ScaledClock()
    with ExitStack() as stack:
        tcp = stack.enter_context(serve_tcp(simulator, clock=clock))
        assist = stack.enter_context(serve_assist(simulator, clock=clock))
        yield ServedEpson(tcp.url, simulator, assist.url)


@pytest.fixture
def softmotion_sim(
    request: pytest.FixtureRequest,
    robolink_state: Path,  # noqa: ARG001 - the state of the test, not the tester's
) -> Iterator[ServedSoftMotion]:
    """A simulated SoftMotion PLC in this process.

    Parametrize it indirectly for other ways to reach it: ``sim``, ``modbus-tcp``,
    ``modbus-rtu`` (not on Windows) and ``can``.
    """
    from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

    simulator = SoftMotionSimulator(seed=request.config.getoption("--robolink-seed"))
    with ExitStack() as stack:
        _serve(simulator, getattr(request, "param", "sim"), stack)
        yield ServedSoftMotion(simulator.url, simulator)


def _serve(simulator: "SoftMotionSimulator", medium: str, stack: ExitStack) -> None:
    name = f"pytest-{id(simulator):x}"
    if medium == "sim":
        from robolink_simulators.hosting.in_process.softmotion import register, unregister

        register(name, simulator)
        stack.callback(unregister, name)
    elif medium == "can":
        from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen

        stack.enter_context(serve_canopen(simulator, CanPlace("virtual", name)))
    else:
        from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu, serve_modbus_tcp

        tcp = medium == "modbus-tcp"
        stack.enter_context(serve_modbus_tcp(simulator) if tcp else serve_modbus_rtu(simulator))


@pytest.fixture
def epson_replay(
    robolink_state: Path,  # noqa: ARG001 - the state of the test, not the tester's
) -> Iterator[Callable[[Path], str]]:
    """A maker of replays: give it a recording, connect to the URL that it returns.

    The test fails when a client asked otherwise than recorded, or did not connect as often.
    """
    from robolink_simulators.hosting.replay import ReplayDevice, read_recording, serve_replay

    devices: list[ReplayDevice] = []
    with ExitStack() as stack:

        def serve(recording: Path) -> str:
            device = ReplayDevice(read_recording(recording))
            devices.append(device)
            return stack.enter_context(serve_replay(device)).url

        yield serve
    differences = [what for device in devices for what in device.differences]
    differences += [
        f"{device.unplayed} recorded connections were not made"
        for device in devices
        if device.unplayed
    ]
    if differences:
        pytest.fail("\n".join(differences), pytrace=False)
