"""What a simulated PLC shows of itself on a CAN bus; whoever hosts it says when."""

import struct
from collections.abc import Callable
from typing import Any, Final

import canopen

from robolink.protocols.mailbox import COMMAND
from robolink.timing import NS_PER_S
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.faults import LinkKind
from robolink_simulators.hosting.fieldbus.canopen_objects import (
    MailboxObjects,
    object_dictionary,
)
from robolink_simulators.hosting.fieldbus.canopen_sdo import PlcSdoServer
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

PERIOD_S: Final = 0.1
"""Of the NMT heartbeat and of TPDO1's event timer, as the data sheet says."""
LOOK_S: Final = 0.01
"""So often a host looks whether something in TPDO1 has changed."""

_PERIOD_NS: Final = round(PERIOD_S * NS_PER_S)
_BOOT_UP: Final = 0
_OPERATIONAL: Final = 5
_PRE_OPERATIONAL: Final = 127
_ENTER_PRE_OPERATIONAL: Final = 128
_TPDO1, _RPDO1, _HEARTBEAT = 0x180, 0x200, 0x700
_HEAD: Final = struct.Struct("<HBBHH")
_BEAT: Final = COMMAND["client_heartbeat"].word


class EventTimer:
    """Says when the heartbeat and TPDO1 are due: by time, however seldom somebody asks.

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
        # canopen declares no types for what is used of it here.
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
        """Send what there is to send: heads that changed, and all of it when it is ``due``."""
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
