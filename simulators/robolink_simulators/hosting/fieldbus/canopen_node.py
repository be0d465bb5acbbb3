"""Serves a simulated PLC as a CANopen node."""

import logging
import struct
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import can
import canopen
from canopen import LocalNode
from canopen.sdo.server import SdoServer

from robolink.errors import ConfigError, ConnectError
from robolink.interrupts import ClosedAtExit
from robolink.messages import tr
from robolink.protocols.mailbox import COMMAND
from robolink.timing import NS_PER_S
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.faults import LinkKind, PlcFault, PlcFaultAction
from robolink_simulators.hosting.fieldbus.canopen_objects import (
    RESPONSE_OBJECT,
    MailboxObjects,
    object_dictionary,
)
from robolink_simulators.softmotion.mailbox.exchange import ServedAccess
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

_REQUEST: Final = 0x600
_ANSWER: Final = 0x580
_SEGMENT_BYTES: Final = 7
_EXPEDITED_BYTES: Final = 4
_TOGGLE: Final = 0x10
_OF_ANOTHER_NODE: Final = bytes.fromhex("4b41600037020000")
"""An answer of a drive: its status word, object 6041h."""


class PlcSdoServer(SdoServer):
    """Answers late or not at all when requested; may refresh an object during its upload.

    Args:
        node: Whose objects.
        real_seconds: Turns a simulated delay into a real one.
    """

    def __init__(self, node: LocalNode, *, real_seconds: Callable[[float], float]) -> None:
        number = node.id or 0
        self._asking_id, self._answering_id = _REQUEST + number, _ANSWER + number
        _untyped(super()).__init__(self._asking_id, self._answering_id, node)
        self._buffer: bytearray | None = None
        self._fresh: Callable[[], bytes] | None = None
        self._real_seconds = real_seconds
        self._silent = False
        self._size = 0
        self._met: tuple[PlcFault, ...] = ()
        self._asked = b""
        self._segments = 0
        self._segment = 0

    def on_request(self, can_id: int, data: bytearray, timestamp: float) -> None:
        """Serve a frame of the client."""
        self._asked = bytes(data)
        _untyped(super()).on_request(can_id, data, timestamp)

    def refresh_from(self, fresh: Callable[[], bytes]) -> None:
        """Let the response change in the middle of its upload, as an unlatched stack would."""
        self._fresh = fresh

    def let_go(self, served: ServedAccess) -> None:
        """Answer the request in progress as ``served`` says."""
        if served.delay_s:
            time.sleep(self._real_seconds(served.delay_s))
        self._silent = not served.answered
        self._met = served.met
        size = 2 * len(served.words)
        self._segments = -(-size // _SEGMENT_BYTES) if size > _EXPEDITED_BYTES else 0
        self._segment = -1  # the answer that only announces segments

    def send_response(self, response: bytes) -> None:
        """Send an answer, unless this one is to be lost; what a plan wants comes with it."""
        silent, self._silent = self._silent, False
        if silent:
            return
        for fault in (due := [fault for fault in self._met if self._is_due(fault)]):
            match fault.action:
                case PlcFaultAction.FOREIGN_NODE:
                    self._network.send_message(self._answering_id, _OF_ANOTHER_NODE)
                case PlcFaultAction.ECHO:
                    self._network.send_message(self._asking_id, self._asked)
                case PlcFaultAction.LOSE_SEGMENT:
                    silent = True
                case PlcFaultAction.WRONG_TOGGLE:
                    response = bytes([response[0] ^ _TOGGLE]) + bytes(response[1:])
        self._met = tuple(fault for fault in self._met if fault not in due)
        if not silent:
            _untyped(super()).send_response(response)

    @property
    def _network(self) -> Any:  # noqa: ANN401 - canopen declares no types here
        return _untyped(self).network

    def _is_due(self, fault: PlcFault) -> bool:
        """Return whether a fault meets the frame that is about to be sent."""
        if fault.action not in (PlcFaultAction.LOSE_SEGMENT, PlcFaultAction.WRONG_TOGGLE):
            return True
        if not self._segments:
            return True
        middle = self._segments // 2 if fault.position is None else fault.position
        return self._segment == middle % self._segments

    def init_upload(self, request: Any) -> None:  # noqa: ANN401 - as canopen declares it
        """Begin an upload."""
        _untyped(super()).init_upload(request)
        self._size = len(self._buffer or b"")

    def segmented_upload(self, command: int) -> None:
        """Send a segment; half-way an unlatched object changes under the client's hands."""
        self._segment += 1
        left = len(self._buffer or b"")
        if self._fresh is not None and self._index == RESPONSE_OBJECT and left < self._size // 2:
            self._buffer = bytearray(self._fresh()[-left:])
            self._size = 0
        _untyped(super()).segmented_upload(command)


def _untyped(server: object) -> Any:  # noqa: ANN401 - canopen declares no types here
    return server


PERIOD_S: Final = 0.1
"""Period in seconds of the NMT heartbeat and of TPDO1's event timer, as in the EDS file."""
LOOK_S: Final = 0.01
"""Interval in seconds at which a host checks TPDO1 for changes."""

_PERIOD_NS: Final = round(PERIOD_S * NS_PER_S)
_BOOT_UP: Final = 0
_OPERATIONAL: Final = 5
_PRE_OPERATIONAL: Final = 127
_ENTER_PRE_OPERATIONAL: Final = 128
_TPDO1, _RPDO1, _HEARTBEAT = 0x180, 0x200, 0x700
_HEAD: Final = struct.Struct("<HBBHH")
_BEAT: Final = COMMAND["client_heartbeat"].word


class EventTimer:
    """Reports when the heartbeat and TPDO1 are due: by time, however seldom it is asked.

    Counted in looks, the period would grow with the load of the computer, until a client takes a
    node that is there for lost. What was missed is not made up for; the phase is kept.

    Args:
        now_ns: From when on; it is due at once.
    """

    def __init__(self, now_ns: int) -> None:
        self._due_ns = now_ns

    def due(self, now_ns: int) -> bool:
        """Whether a period is over; the next one then runs."""
        if now_ns < self._due_ns:
            return False
        self._due_ns += (1 + (now_ns - self._due_ns) // _PERIOD_NS) * _PERIOD_NS
        return True


class CanopenFace:
    """A node with the mailbox's objects, its PDOs and its heartbeat.

    Args:
        simulator: The PLC.
        number: Of the node.
        clock: The simulated time.
        network: The bus.
        real_seconds: Turns a simulated delay of an answer into the time to wait for it.
    """

    def __init__(
        self,
        simulator: SoftMotionSimulator,
        number: int,
        clock: ScaledClock | ManualClock,
        network: canopen.Network,
        *,
        real_seconds: Callable[[float], float],
    ) -> None:
        self._simulator = simulator
        self._clock = clock
        self._id = number
        self._network = network
        self._starts = simulator.plc.starts
        self._sent: tuple[int, ...] = ()
        # canopen declares no types for the parts used here.
        node: Any = canopen.LocalNode(number, object_dictionary(number))
        node.sdo = server = PlcSdoServer(node, real_seconds=real_seconds)
        objects = MailboxObjects(simulator, self._asked, server)
        if not simulator.options.mailbox.snapshot_latched:
            server.refresh_from(objects.fresh)
        node.add_read_callback(objects.read)
        node.add_write_callback(objects.write)
        network.add_node(node)
        self._node = node
        network.subscribe(_RPDO1 + number, self._beaten)

    def _asked(self) -> int:
        """Return the time at which a request is served."""
        self._clock.exchanged()
        return self._clock.now_ns()

    def boot(self) -> None:
        """Announce a start; the client then has to start the node."""
        self._node.nmt.on_command(0, bytes([_ENTER_PRE_OPERATIONAL, self._id]), 0.0)
        self._network.send_message(_HEARTBEAT + self._id, bytes([_BOOT_UP]))

    def look(self, *, due: bool) -> None:
        """Send what is due: heads that changed, and all of it when it is ``due``."""
        if self._starts != self._simulator.plc.starts:
            self._starts = self._simulator.plc.starts
            self.boot()
        operational = self._node.nmt.state == "OPERATIONAL"
        if operational:
            self._send_head(due=due)
        if due:
            state = _OPERATIONAL if operational else _PRE_OPERATIONAL
            self._network.send_message(_HEARTBEAT + self._id, bytes([state]))

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


for _name in ("can", "canopen"):  # without a handler they write to standard error
    logging.getLogger(_name).addHandler(logging.NullHandler())

_NOTIFIER_CYCLE_S: Final = 0.02
MULTICAST_PORT: Final = 43113
"""Default port of python-can."""


@dataclass(frozen=True, slots=True)
class CanPlace:
    """The place of a node on the bus.

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
        """Return python-can's settings. Multicast frames never leave this computer."""
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
        if self._clock.stepped(simulated):
            return 0.0
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
