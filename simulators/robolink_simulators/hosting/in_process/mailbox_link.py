"""A mailbox link into a simulated PLC of this process."""

from collections.abc import Callable, Sequence
from typing import Final

from robolink.errors import (
    RobolinkError,
    TransportBrokenError,
    TransportClosedError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.protocols.mailbox import (
    COMMAND,
    DEVICE_START,
    DEVICE_WORDS,
    RESPONSE_WORDS,
    SLOT_WORDS,
    Words,
    slot_start,
)
from robolink.transport import MailboxHead
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.faults import PlcFaultAction
from robolink_simulators.softmotion.mailbox.exchange import ServedAccess
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

_HEAD_WORDS: Final = 10
_HEARTBEAT: Final = COMMAND["client_heartbeat"].word


class InProcessMailboxLink:
    """Implements :class:`robolink.transport.MailboxLink`; each exchange takes simulated time.

    It outlives a restart of the PLC, as a serial line does, and no pulled cable.

    Args:
        identity: Which simulator.
        simulator: The PLC.
        clock: Its clock.
        timeout_s: Longest wait for an answer.
    """

    def __init__(
        self, identity: str, simulator: SoftMotionSimulator, clock: ManualClock, timeout_s: float
    ) -> None:
        self._identity = identity
        self._simulator = simulator
        self._clock = clock
        self._timeout_s = timeout_s
        self._exchange_s = simulator.options.mailbox.exchange_us / 1e6
        self._closed = False
        self._cuts = simulator.plc.cuts
        with simulator.lock:
            simulator.hear(clock.now_ns())

    @property
    def identity(self) -> str:
        """See :attr:`robolink.transport.MailboxLink.identity`."""
        return self._identity

    @property
    def place(self) -> str:
        """See :attr:`robolink.transport.MailboxLink.place`."""
        return self._identity.partition("://")[2]

    @property
    def durable(self) -> bool:
        """Whether the simulator keeps its slots in a file."""
        return self._simulator.durable

    @property
    def clock(self) -> ManualClock:
        """The simulator's clock."""
        return self._clock

    @property
    def whole_look_s(self) -> float:
        """0: nothing is carried anywhere."""
        return 0.0

    def write_command(self, words: Sequence[int], admit: Callable[[], None] = lambda: None) -> None:
        """See :meth:`robolink.transport.MailboxLink.write_command`."""
        admit()
        self._exchange(lambda now_ns: self._simulator.write(0, words, now_ns))

    def read_head(self) -> MailboxHead:
        """See :meth:`robolink.transport.MailboxLink.read_head`."""
        words = self._exchange(lambda now_ns: self._simulator.read(0, _HEAD_WORDS, now_ns))
        return MailboxHead(words[1], words[2], words[3], words[7], words[9])

    def read_response(self) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_response`."""
        return self._exchange(lambda now_ns: self._simulator.read(0, RESPONSE_WORDS, now_ns))

    def read_slot(self, slot: int) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_slot`."""
        first = slot_start(slot)
        return self._exchange(lambda now_ns: self._simulator.read(first, SLOT_WORDS, now_ns))

    def read_device(self) -> Words:
        """See :meth:`robolink.transport.MailboxLink.read_device`."""
        return self._exchange(
            lambda now_ns: self._simulator.read(DEVICE_START, DEVICE_WORDS, now_ns)
        )

    def beat(self, word: int) -> None:
        """See :meth:`robolink.transport.MailboxLink.beat`."""
        self._exchange(lambda now_ns: self._simulator.write(_HEARTBEAT, (word,), now_ns))

    def reopened(self, *, timeout_s: float) -> "InProcessMailboxLink":
        """See :meth:`robolink.transport.MailboxLink.reopened`."""
        return InProcessMailboxLink(self._identity, self._simulator, self._clock, timeout_s)

    def close(self) -> None:
        """See :meth:`robolink.transport.MailboxLink.close`."""
        self._closed = True

    def _exchange(self, serve: Callable[[int], ServedAccess]) -> Words:
        """Let a request be served: half of the time passes before, half of it after."""
        with self._simulator.lock:
            if self._closed:
                raise TransportClosedError(
                    tr("The connection to {identity} is closed.", identity=self._identity),
                    remedy=tr("Connect again."),
                    controller=self._identity,
                )
            self._clock.advance(self._exchange_s / 2)
            if self._pulled:
                raise self._broken()
            served = serve(self._clock.now_ns())  # the simulator catches up before it serves
            if served.cut or (served.met and served.meets(PlcFaultAction.RESET)):
                raise self._broken()
            silent = not served.answered or (served.met and served.meets(PlcFaultAction.HALF_OPEN))
            if silent or served.delay_s > self._timeout_s:
                self._pass(self._timeout_s)
                raise self._ended(
                    TransportTimeoutError(
                        tr("{identity} did not answer in time.", identity=self._identity),
                        remedy=tr("Look at the simulator's log, then connect again."),
                        controller=self._identity,
                    )
                )
            if served.delay_s:
                self._pass(served.delay_s)
                if self._pulled:  # the answer does not arrive any more
                    raise self._broken()
            # Events due in this half happen, each at its time, before the next request.
            self._clock.advance(self._exchange_s / 2)
            return served.words

    @property
    def _pulled(self) -> bool:
        """Whether somebody has pulled the cable since this link was opened."""
        return self._cuts != self._simulator.plc.cuts

    def _broken(self) -> RobolinkError:
        return self._ended(
            TransportBrokenError(
                tr("{identity} cut the connection.", identity=self._identity),
                remedy=tr("Connect again."),
                controller=self._identity,
            )
        )

    def _pass(self, seconds: float) -> None:
        self._clock.advance(seconds)
        self._simulator.advance(self._clock.now_ns())

    def _ended(self, error: RobolinkError) -> RobolinkError:
        self._closed = True
        return error
