"""Serves a simulated PLC as a CANopen node."""

import logging
import threading
import time
from dataclasses import dataclass
from typing import Any, Final

import can
import canopen

from robolink.closing import ClosedAtExit
from robolink.errors import ConfigError, ConnectError
from robolink.messages import tr
from robolink.timing import NS_PER_S
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.fieldbus.canopen_face import LOOK_S, CanopenFace, EventTimer
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

for _name in ("can", "canopen"):  # they write to standard error when nobody listens
    logging.getLogger(_name).addHandler(logging.NullHandler())

_NOTIFIER_CYCLE_S: Final = 0.02
MULTICAST_PORT: Final = 43113
"""python-can's own."""


@dataclass(frozen=True, slots=True)
class CanPlace:
    """Where a node is put.

    Attributes:
        interface: Of python-can: ``virtual``, ``udp_multicast``, ``socketcan`` ...
        channel: Name of the channel; the group of ``udp_multicast``.
        port: Of ``udp_multicast``.
        node: Number of the node.
    """

    interface: str
    channel: str
    port: int = MULTICAST_PORT
    node: int = 5

    @property
    def url(self) -> str:
        """Where clients connect to."""
        port = f":{self.port}" if self.interface == "udp_multicast" else ""
        host = f"softmotion+can://{self.channel}{port}"
        return f"{host}?interface={self.interface}&node={self.node}"

    def settings(self) -> dict[str, Any]:
        """Return what python-can is told. Multicast frames never leave this computer."""
        settings: dict[str, Any] = {"interface": self.interface, "channel": self.channel}
        if self.interface == "udp_multicast":
            settings |= {"port": self.port, "hop_limit": 0, "fd": False}
        return settings


class CanopenHost(ClosedAtExit):
    """A node in front of a simulated PLC; a context manager.

    Args:
        simulator: The PLC.
        place: Where it is put.
        clock: The simulated time.
        network: The bus, which the host owns from here on.
    """

    def __init__(
        self,
        simulator: SoftMotionSimulator,
        place: CanPlace,
        clock: ScaledClock,
        network: canopen.Network,
    ) -> None:
        self.url = place.url
        self._simulator = simulator
        self._clock = clock
        self._network = network
        self._face = CanopenFace(
            simulator, place.node, clock, network, real_seconds=self._real_seconds
        )
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._live, name="canopen host", daemon=True)
        self._face.boot()
        self._thread.start()

    def close(self) -> None:
        """Take the node off the bus. Idempotent."""
        if not self._ending.is_set():
            self._ending.set()
            self._thread.join()
            self._network.disconnect()
            if self._simulator.url == self.url:
                self._simulator.url = ""

    def _real_seconds(self, simulated: float) -> float:
        return self._clock.real_seconds(self._clock.now_ns() + round(simulated * NS_PER_S))

    def _live(self) -> None:
        """Send heads and heartbeats until the end."""
        timer = EventTimer(time.monotonic_ns())
        while not self._ending.wait(LOOK_S):
            self._face.look(due=timer.due(time.monotonic_ns()))


def serve_canopen(
    simulator: SoftMotionSimulator, place: CanPlace, *, clock: ScaledClock | None = None
) -> CanopenHost:
    """Put a PLC on a CAN bus.

    Args:
        simulator: The PLC.
        place: Which bus, which node.
        clock: The simulated time; real time by default.

    Raises:
        ConfigError: The interface is not known, or lacks something.
        ConnectError: The bus cannot be opened.
    """
    clock = clock or ScaledClock()
    simulator.keep_time(clock)
    network = _connected(place)
    host = CanopenHost(simulator, place, clock, network)
    simulator.url = simulator.url or host.url
    return host


def _connected(place: CanPlace) -> canopen.Network:
    network = canopen.Network()
    network.NOTIFIER_CYCLE = _NOTIFIER_CYCLE_S
    try:
        network.connect(ignore_config=True, **place.settings())
    except (NotImplementedError, ImportError, TypeError, ValueError) as error:
        raise ConfigError(
            tr(
                "The CAN interface {name!r} cannot be used: {cause}.",
                name=place.interface,
                cause=error,
            ),
            remedy=tr("Use udp_multicast with 'pip install robolink[udp-multicast]'."),
        ) from error
    except (can.CanError, OSError) as error:
        raise ConnectError(
            tr(
                "The CAN bus {identity} cannot be opened: {cause}.",
                identity=place.channel,
                cause=error,
            ),
            remedy=tr("Check that the interface is up, or take another group and port."),
        ) from error
    return network
