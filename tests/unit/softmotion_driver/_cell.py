"""A link to a PLC mailbox that can fail on demand, and a record beside it."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Any, TypeVar

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.softmotion.mailbox.image import arranged

from robolink.controllers import SoftMotionController, open_softmotion
from robolink.errors import (
    ConnectError,
    RejectedError,
    RobolinkError,
    TransportClosedError,
    TransportTimeoutError,
)
from robolink.journal import memory_journal
from robolink.model import Signature, new_operation
from robolink.protocols.mailbox import RESPONSE, SLOT, WordOrder, encode_slot
from robolink.transport import MailboxHead
from tests.unit.softmotion_driver._plc import Plc

T = TypeVar("T")
Distortion = Callable[[tuple[int, ...]], tuple[int, ...]]
Mishap = Callable[[Callable[[], Any]], Any]


class PlcLink:
    """A :class:`robolink.transport.MailboxLink` to a :class:`Plc`, in the same thread.

    Each exchange takes a time of the PLC's clock, usually a millisecond.

    Attributes:
        reachable: Whether another link can be opened when this one has ended.
        recovers: Whether it can be used after a lost answer, like a serial line.
        sent: Every command block, as written.
        beats: Every heartbeat word that was written alone.
        response: Changes every response block that is read.
        command: Changes every command block on its way.
        answer_s: How long an exchange takes.
    """

    def __init__(self, plc: Plc) -> None:
        self.plc = plc
        self.clock = plc.clock
        self.identity = f"softmotion+sim://{new_operation()}"
        self.place = self.identity.partition("://")[2]
        self.durable = False
        self.reachable = False
        self.recovers = False
        self.closed = False
        self.sent: list[tuple[int, ...]] = []
        self.beats: list[int] = []
        self.response: Distortion = tuple
        self.command: Distortion = tuple
        self.answer_s = 0.001
        self._order = WordOrder.LOW_FIRST
        self._mishaps: dict[str, list[Mishap]] = {}

    def plan(self, method: str, mishap: Mishap, *, nth: int = 1) -> None:
        """Plan an event at the nth call of a method from now on, once."""
        planned = self._mishaps.setdefault(method, [])
        planned.extend([_no_mishap] * (nth - 1))
        planned.append(mishap)

    def lose_answer(self, method: str, *, nth: int = 1) -> None:
        """Let the nth request arrive, and lose its answer."""

        def mishap(deliver: Callable[[], T]) -> T:
            deliver()
            raise self.silence()

        self.plan(method, mishap, nth=nth)

    def lose_request(self, method: str, *, nth: int = 1) -> None:
        """Lose the nth request."""

        def mishap(_deliver: Callable[[], T]) -> T:
            raise self.silence()

        self.plan(method, mishap, nth=nth)

    def refuse(self, method: str) -> None:
        """Let the next request be refused in an answer, which closes no link."""

        def mishap(_deliver: Callable[[], T]) -> T:
            raise RejectedError("busy", remedy="wait", code=6)

        self.plan(method, mishap)

    def hold_up(self, method: str) -> Callable[[], None]:
        """Let the PLC notice the next request only when what is returned is called."""
        held: list[Callable[[], Any]] = []
        self.plan(method, held.append)
        return lambda: held.pop()()

    def forget_plans(self) -> None:
        """Let everything arrive from now on."""
        self._mishaps.clear()

    def before(self, method: str, act: Callable[[], object], *, nth: int = 1) -> None:
        """Run something just before the nth request arrives."""

        def mishap(deliver: Callable[[], T]) -> T:
            act()
            return deliver()

        self.plan(method, mishap, nth=nth)

    def lay_high_first(self) -> None:
        """Let the PLC store the high word of multi-word values first from now on."""
        self._order = WordOrder.HIGH_FIRST

    def silence(self) -> RobolinkError:
        """Return the error of a time-out, which closes most links."""
        self.closed = not self.recovers
        return TransportTimeoutError("no answer", remedy="look")

    def write_command(self, words: Sequence[int], admit: Callable[[], None] = lambda: None) -> None:
        """Write the command block."""
        admit()
        changed = self.command(tuple(words))
        self.sent.append(tuple(words))
        self._exchange("write_command", lambda: self.plc.receive(changed))

    @property
    def whole_look_s(self) -> float:
        return 0.0

    def read_head(self) -> MailboxHead:
        """Read the head."""
        return self._exchange("read_head", self.plc.head)

    def read_response(self) -> tuple[int, ...]:
        """Read the response block."""
        words = self._exchange("read_response", self.plc.response)
        return self.response(arranged(RESPONSE, words, self._order))

    def read_slot(self, slot: int) -> tuple[int, ...]:
        """Read a tool slot."""
        words = self._exchange("read_slot", lambda: encode_slot(self.plc.slots[slot]))
        return arranged(SLOT, words, self._order)

    def read_device(self) -> tuple[int, ...]:
        """Read the device block; an old program has none."""
        return self._exchange("read_device", lambda: self.plc.device)

    def beat(self, word: int) -> None:
        """Write the heartbeat."""
        self.beats.append(word)
        self._exchange("beat", lambda: self.plc.take_beat(word))

    def reopened(self, *, timeout_s: float) -> "PlcLink":
        """Open another link, unless the PLC cannot be reached."""
        if not self.reachable:
            raise ConnectError("no answer", remedy="connect again")
        return PlcLink(self.plc)

    def close(self) -> None:
        """Close."""
        self.closed = True

    def _exchange(self, method: str, deliver: Callable[[], T]) -> T:
        if self.closed:
            raise TransportClosedError("closed", remedy="connect again")
        self.clock.sleep(self.answer_s)
        planned = self._mishaps.get(method)
        mishap: Mishap = planned.pop(0) if planned else _no_mishap
        answer: T = mishap(deliver)
        return answer


def _no_mishap(deliver: Callable[[], T]) -> T:
    return deliver()


class Cell:
    """A PLC, and controllers connected to it.

    Attributes:
        outcomes: The record that all of them share.
    """

    def __init__(self) -> None:
        self._open = ExitStack()
        self.plc = Plc(ManualClock())
        self.link = PlcLink(self.plc)
        self.outcomes = memory_journal(self.link.identity).log(
            self.link.identity, signature=Signature()
        )

    def connect(self) -> SoftMotionController:
        """Connect over a new link."""
        identity, self.link = self.link.identity, PlcLink(self.plc)
        self.link.identity = identity
        return self.met()

    def met(self) -> SoftMotionController:
        """Open a session over the present link."""
        controller = open_softmotion(self.link, outcomes=self.outcomes, timeout_s=0.5)
        # Without a command to the PLC: the events that the test planned are over.
        self._open.callback(controller._mailbox.wire.close)
        return controller

    def close(self) -> None:
        """Close everything opened here."""
        self._open.close()

    def open_requests(self) -> list[str]:
        """Return the requests of open markers."""
        return [marker.request for marker in self.outcomes.open_markers()]
