"""A simulated PLC on each of the ways on which robolink reaches one."""

import socket
import time
from collections.abc import Iterator
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

BACKENDS: Final = ("sim", "modbus-tcp", "modbus-rtu", "can-virtual", "can-multicast")
LINKS: Final = [
    pytest.param(name, marks=pytest.mark.soak if name == "can-virtual" else ()) for name in BACKENDS
]
"""What a test of every link takes: the bus of one process is left to make soak, for the one
between processes asks more."""
OWNER_SILENCE_S: Final = 10.1
"""After this long without a sign of its owner a mailbox is free.

Source: docs/reference/mailbox.md, "Owners".
"""

QUICK: Final = MotionProfile(Path.STRAIGHT, speed_mm_s=1000.0)
SLOW: Final = MotionProfile(Path.STRAIGHT, speed_mm_s=2.0)

_COMMAND: Final = "write_command "
_GROUP: Final = "239.74.163.9"
_ANNOUNCED_S: Final = 0.05
"""By then a CANopen node has sent its boot-up message."""

_names = count()


class SkippingClock:
    """Real time, in which a test need not wait for what takes long."""

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
        """Skip some time."""
        self._skipped_ns += round(seconds * NS_PER_S)


class PlcCell:
    """A simulated PLC, and how it is reached.

    Attributes:
        url: Where to connect to.
        simulator: The PLC.
        clock: The simulated time; ``advance`` lets some of it pass at once.
        journal: The record that all who connect share.
    """

    def __init__(
        self, url: str, simulator: SoftMotionSimulator, clock: SkippingClock | ManualClock
    ) -> None:
        self.url = url
        self.simulator = simulator
        self.clock = clock
        self.journal: Journal = memory_journal(f"{url} {next(_names)}")

    def connect(self, **options: Any) -> SoftMotionController:
        """Connect; what is done is kept in the record of this cell."""
        log = self.journal.log(self.url)
        controller = robolink.connect(self.url, outcomes=log, **options)
        assert isinstance(controller, SoftMotionController)
        return controller

    @property
    def commands(self) -> list[str]:
        """The commands that clients wrote so far, but for those about the ownership."""
        arrived = [text for _, way, text in self.simulator.log if way == ">"]
        named = [text.split()[1] for text in arrived if text.startswith(_COMMAND)]
        return [name for name in named if name != "OWNERSHIP"]

    @property
    def movements_started(self) -> int:
        """How many movements and jogs the axis group began."""
        return self.simulator.plc.group.movements_started

    @property
    def owner(self) -> int:
        """Token of the client that owns the mailbox, 0 for nobody."""
        return self.simulator.plc.program.holder

    @property
    def open_requests(self) -> list[str]:
        """What is unsettled."""
        return [marker.request for _, marker in self.journal.open_markers()]

    def restart(self) -> None:
        """Start the PLC anew; whoever connects afterwards does not hear of it any more."""
        self.simulator.panel.restart()
        time.sleep(_ANNOUNCED_S)

    def slot_changes(self, slot: int) -> int:
        """Return how often the PLC changed a slot."""
        return self.simulator.plc.memory.slot(slot).counter


@contextmanager
def served(backend: str, simulator: SoftMotionSimulator | None = None) -> Iterator[PlcCell]:
    """Offer a PLC, in real time wherever there is a real link."""
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


def above(pose: Pose, by_mm: float) -> Pose:
    """Return the pose so far above another one."""
    return replace(pose, z_mm=pose.z_mm + by_mm)
