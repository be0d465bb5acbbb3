"""A simulated PLC on each link by which robolink reaches one."""

import socket
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import count
from typing import Any, Final

import pytest
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit import media

import robolink
from robolink.controllers import SoftMotionController
from robolink.journal import Journal, memory_journal
from robolink.model import MotionProfile, Path, Pose
from robolink.timing import NS_PER_S, SystemClock

BACKENDS: Final = ("sim", "modbus-tcp", "modbus-rtu", "can-virtual", "can-multicast", "opcua")
LINKS: Final = [
    pytest.param(name, marks=pytest.mark.soak if name == "can-virtual" else ()) for name in BACKENDS
]
"""The links that every test of links uses. The bus within one process is left to ``make soak``: the
bus between processes demands more.
"""
OWNER_SILENCE_S: Final = 10.1
"""A mailbox is free after its owner has been silent for this long.

Source: docs/reference/mailbox.md, "Owners".
"""

QUICK: Final = MotionProfile(Path.STRAIGHT, speed_mm_s=1000.0)
SLOW: Final = MotionProfile(Path.STRAIGHT, speed_mm_s=2.0)

_COMMAND: Final = "write_command "
_GROUP: Final = "239.74.163.9"
_ANNOUNCED_S: Final = 0.05
"""A CANopen node has sent its boot-up message after this time."""

_names = count()


class SkippingClock:
    """Real time, from which a test can skip long waits."""

    def __init__(self) -> None:
        self._base = SystemClock()
        self._skipped_ns = 0

    def now_ns(self) -> int:
        """Return the time in nanoseconds."""
        return self._base.now_ns() + self._skipped_ns

    def sleep(self, seconds: float) -> None:
        """Wait in real time."""
        self._base.sleep(seconds)

    def advance(self, seconds: float) -> None:
        """Skip some seconds."""
        self._skipped_ns += round(seconds * NS_PER_S)


class PlcCell:
    """A simulated PLC and the link to it.

    Attributes:
        url: The address to connect to.
        simulator: The PLC.
        clock: The simulated time; ``advance`` skips some of it.
        journal: The record that all connections share.
    """

    def __init__(
        self, url: str, simulator: SoftMotionSimulator, clock: SkippingClock | ManualClock
    ) -> None:
        self.url = url
        self.simulator = simulator
        self.clock = clock
        self.journal: Journal = memory_journal(f"{url} {next(_names)}")

    def connect(self, **options: Any) -> SoftMotionController:
        """Connect, with the record of this cell."""
        log = self.journal.log(self.url)
        controller = robolink.connect(self.url, outcomes=log, **options)
        assert isinstance(controller, SoftMotionController)
        return controller

    @property
    def commands(self) -> list[str]:
        """The commands that clients wrote so far, except those about ownership."""
        arrived = [text for _, way, text in self.simulator.log if way == ">"]
        named = [text.split()[1] for text in arrived if text.startswith(_COMMAND)]
        return [name for name in named if name != "OWNERSHIP"]

    @property
    def movements_started(self) -> int:
        """The number of movements and jogs that the axis group began."""
        return self.simulator.plc.group.movements_started

    @property
    def owner(self) -> int:
        """The token of the client that owns the mailbox; 0 if there is none."""
        return self.simulator.plc.program.holder

    @property
    def open_requests(self) -> list[str]:
        """The requests of open markers."""
        return [marker.request for _, marker in self.journal.open_markers()]

    def restart(self) -> None:
        """Restart the PLC; clients that connect afterwards do not see the restart."""
        self.simulator.panel.restart()
        time.sleep(_ANNOUNCED_S)

    def slot_changes(self, slot: int) -> int:
        """Return how often the PLC changed a slot."""
        return self.simulator.plc.memory.slot(slot).counter


@contextmanager
def served(backend: str, simulator: SoftMotionSimulator | None = None) -> Iterator[PlcCell]:
    """Serve a PLC, in real time on every real link."""
    simulator = simulator or SoftMotionSimulator(seed=7)
    clock: ManualClock | SkippingClock = ManualClock() if backend == "sim" else SkippingClock()
    simulated = clock if isinstance(clock, ManualClock) else ScaledClock(base=clock)
    with hosted(backend, simulator, simulated) as url:
        yield PlcCell(url, simulator, clock)


@contextmanager
def hosted(
    backend: str, simulator: SoftMotionSimulator, clock: ManualClock | ScaledClock
) -> Iterator[str]:
    """Serve a PLC on one of the links; yields its URL."""
    if backend != "can-multicast":
        medium = "can" if backend == "can-virtual" else backend
        with media.served(simulator, medium, clock=clock) as url:
            yield url
        return
    assert isinstance(clock, ScaledClock)
    place = CanPlace("udp_multicast", _GROUP, port=_free_port())
    with serve_canopen(simulator, place, clock=clock) as host:
        yield host.url


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def on_links(value: object, links: Iterable[Any]) -> list[Any]:
    """Return a parameter with each of some links, which keep their marks."""
    return [pytest.param(value, *link.values, marks=link.marks) for link in links]


def few_links(*others: str) -> list[Any]:
    """Return the links of a test about what lies above the link; the rest is ``make soak``'s.

    In process, and over ``others``, which such tests take in turn.
    """
    used = ("sim", *others)
    return [pytest.param(name, marks=() if name in used else pytest.mark.soak) for name in BACKENDS]


def above(pose: Pose, by_mm: float) -> Pose:
    """Return the pose a given distance above another one."""
    return replace(pose, z_mm=pose.z_mm + by_mm)
