"""Serves a simulated PLC as a CANopen node."""

import logging
import struct
import threading
from dataclasses import dataclass
from typing import Any, Final

import can
import canopen

from robolink.closing import ClosedAtExit
from robolink.errors import ConfigError, ConnectError
from robolink.messages import tr
from robolink.protocols.mailbox import COMMAND
from robolink.timing import NS_PER_S
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.faults import LinkKind
from robolink_simulators.hosting.fieldbus.canopen_objects import (
    MailboxObjects,
    object_dictionary,
)
from robolink_simulators.hosting.fieldbus.canopen_sdo import PlcSdoServer
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

for _name in ("can", "canopen"):  # they write to standard error when nobody listens
    logging.getLogger(_name).addHandler(logging.NullHandler())

_BOOT_UP: Final = 0
_OPERATIONAL: Final = 5
_PRE_OPERATIONAL: Final = 127
_ENTER_PRE_OPERATIONAL: Final = 128
_TPDO1, _RPDO1, _HEARTBEAT = 0x180, 0x200, 0x700
_HEAD: Final = struct.Struct("<HBBHH")
_BEAT: Final = COMMAND["client_heartbeat"].word
_LOOK_S: Final = 0.01
_PERIOD_S: Final = 0.1
"""Of the NMT heartbeat and of TPDO1's event timer, as the data sheet says."""
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
        self._id = place.node
        self._network = network
        self._starts = simulator.plc.starts
        self._sent: tuple[int, ...] = ()
        # canopen declares no types for what is used of it here.
        node: Any = canopen.LocalNode(place.node, object_dictionary(place.node))
        node.sdo = server = PlcSdoServer(node, real_seconds=self._real_seconds)
        objects = MailboxObjects(simulator, clock.now_ns, server)
        if not simulator.options.mailbox.snapshot_latched:
            server.refresh_from(objects.fresh)
        node.add_read_callback(objects.read)
        node.add_write_callback(objects.write)
        network.add_node(node)
        self._node = node
        network.subscribe(_RPDO1 + self._id, self._beaten)
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._live, name="canopen host", daemon=True)
        self._boot()
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

    def _boot(self) -> None:
        """Announce a start; the client then has to start the node."""
        self._node.nmt.on_command(0, bytes([_ENTER_PRE_OPERATIONAL, self._id]), 0.0)
        self._network.send_message(_HEARTBEAT + self._id, bytes([_BOOT_UP]))

    def _live(self) -> None:
        """Send heads and heartbeats until the end."""
        rounds = round(_PERIOD_S / _LOOK_S)
        count = 0
        while not self._ending.wait(_LOOK_S):
            count += 1
            due = count % rounds == 0
            self._look_for_a_start()
            operational = self._node.nmt.state == "OPERATIONAL"
            if operational:
                self._send_head(due=due)
            if due:
                state = _OPERATIONAL if operational else _PRE_OPERATIONAL
                self._network.send_message(_HEARTBEAT + self._id, bytes([state]))

    def _look_for_a_start(self) -> None:
        if self._starts != self._simulator.plc.starts:
            self._starts = self._simulator.plc.starts
            self._boot()

    def _send_head(self, *, due: bool) -> None:
        """Send TPDO1 when something in it but the heartbeat changed, and when it is due."""
        with self._simulator.lock:
            now_ns = self._clock.now_ns()
            self._simulator.advance(now_ns)
            words = self._simulator.plc.response(now_ns)
        head = (words[1], words[2], words[7], words[3])
        if due or head != self._sent:
            self._sent = head
            self._network.send_message(_TPDO1 + self._id, _HEAD.pack(*head, words[9]))

    def _beaten(self, _identifier: int, data: bytearray, _timestamp: float) -> None:
        if len(data) == 2 and self._node.nmt.state == "OPERATIONAL":
            with self._simulator.lock:
                word = int.from_bytes(data, "little")
                self._simulator.write(_BEAT, (word,), self._clock.now_ns(), LinkKind.CAN)


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
    simulator.present_ns = clock.now_ns
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
                "The CAN bus {channel} cannot be opened: {cause}.",
                channel=place.channel,
                cause=error,
            ),
            remedy=tr("Check that the interface is up, or take another group and port."),
        ) from error
    return network
