"""The interface of every simulated controller to hosts, panels and tests."""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, ClassVar, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.device.wire_record import MotionLog, StartedMotion, WireRecord
from robolink_simulators.device.wire_time import WireClock, WireTime
from robolink_simulators.not_now import NotNowError
from robolink_simulators.state_files import StateNotKeptError

RequestHook = Callable[[int, str], None]
"""Called with the running number and the text of a request or reply; passwords are hidden."""

SCHEMA: Final = "robolink/sim-truth/1"

NEW: Final[Mapping[str, int]] = MappingProxyType(
    {"moves_started": 0, "tool_writes": 0, "starts": 1, "touches": 0}
)
"""The counts of a newly made controller."""


LONGEST_ANSWER_MS: Final = 10_000.0
"""Longest answer time of a simulator in milliseconds; longer than any client waits."""


@dataclass(frozen=True)
class KeptMoment:
    """The state of a simulated controller and its world at an instant, for a restore.

    Attributes:
        machine: Which kind and model; only such a one can go back to it.
        held: What is restored, by name.
    """

    machine: str
    held: Mapping[str, Any] = field(repr=False)


class HostedDevice(ABC):
    """The interface of all simulated controllers. Time is given, never taken.

    Args:
        seed: Decides the world and every scatter.
        answer_ms: How long after a request arrives its answer leaves, in simulated milliseconds.
            What is requested begins on arrival; the answer to a movement leaves so long after
            the end of it.

    Attributes:
        answer_s: The same in simulated seconds. Faults that delay an answer add to it.
        lock: Held by whoever touches it while a host serves it.
        url: Where the first host serves it, empty when none does.
        now_ns: The instant last given; for others to read.
        seed: Decides the world and every scatter.
        exchanges: Requests answered.
        log: What crossed the wire.
        on_request: Called with a request before it is carried out; what it raises goes to the
            host, and the request is carried out all the same.
        on_reply: Called with the answer before it leaves; it leaves all the same.
        watchers: Called after each act past the wire, so that a host looks for what leaves now.
        present_ns: Tells such acts the time, in place of the instant given last.
        wire_time: By which it counts how long a client is silent.
        durable: Whether what it keeps outlives the process.
        kind: ``epson``, ``softmotion`` or ``plc``.

    Raises:
        ConfigError: The answer time is negative, or longer than :data:`LONGEST_ANSWER_MS`.
    """

    kind: ClassVar[str]

    def __init__(self, seed: int, *, answer_ms: float = 0.0) -> None:
        if not 0 <= answer_ms <= LONGEST_ANSWER_MS:
            raise ConfigError(
                tr("A simulator cannot answer after {ms:g} ms.", ms=answer_ms),
                remedy=tr("Give a time from 0 to {most:g} ms.", most=LONGEST_ANSWER_MS),
            )
        self.answer_s = answer_ms / 1000
        self.lock = threading.RLock()
        self.url, self.seed = "", seed
        self.watchers: list[Callable[[], None]] = []
        self.present_ns: Callable[[], int] | None = None
        self.wire_time = WireTime()
        self.exchanges = 0
        self.log = WireRecord()
        self.on_request: RequestHook | None = None
        self.on_reply: RequestHook | None = None
        self.durable = False
        self.now_ns = 0
        self._stepping = False
        self._requests = 0
        self._counted_before: dict[str, int] = {}

    def keep_time(self, clock: WireClock) -> None:
        """Take the present time from a clock; the host calls this."""
        self.present_ns, self.wire_time.clock = clock.now_ns, clock

    @contextmanager
    def acting(self) -> Iterator[int]:
        """Surround an act from outside the wire; gives the present time."""
        with self.lock:
            # A planned act happens at its planned time, in the middle of an advance.
            if self.present_ns is not None and not self._stepping:
                self.advance(self.present_ns())
            try:
                yield self.now_ns
            finally:
                self._after_act()
        for watcher in tuple(self.watchers):
            watcher()

    def truth(self) -> dict[str, Any]:
        """Return the true state, ready for JSON, with the same keys for every kind.

        ``stored`` are the tools that the controller holds, by number, ``selected_tool`` is the
        one in force; where it has a world, all of that too (``Workplace.truth``). Lengths are
        in mm, angles U, V, W in degrees as in an EPSON controller (R = Rz(U) Ry(V) Rx(W)).
        """
        with self.lock:
            return {"schema": SCHEMA, "kind": self.kind, **self._truth()}

    def reset(self) -> None:
        """Make it anew, as at first, but as another controller.

        Its serial number is drawn anew, so that nothing on record hangs on it; links are cut,
        planned faults, the log and the counters are forgotten. Time goes on.

        Raises:
            ConfigError: It keeps its state in a file, or executes a program that was loaded:
                neither can be taken for new.
        """
        self._require_renewable()
        with self.acting():
            self._renew()
            self._requests = 0
            self.forget_past()

    def forget_past(self) -> None:
        """Restart the counts, with an empty log; nothing else is changed."""
        with self.lock:
            self.exchanges = 0
            self._count_on()
            self.log.clear()

    def kept_moment(self) -> KeptMoment:
        """Return the state for a restore: tools, world, place of the robot, identity."""
        with self.acting():
            return KeptMoment(self.machine_name, self._moment())

    def go_back(self, moment: KeptMoment) -> None:
        """Restore that state, at rest, with nobody connected; faults are removed.

        What is counted goes on, and the log too: both tell what there was since :meth:`reset`.

        Raises:
            ConfigError: That was another kind of machine; or as for :meth:`reset`.
        """
        if moment.machine != self.machine_name:
            raise ConfigError(
                tr(
                    "A snapshot of {one} cannot be put into {other}.",
                    one=moment.machine,
                    other=self.machine_name,
                ),
                remedy=tr("Take one of this simulator."),
            )
        self._require_renewable()
        with self.acting():
            counted = self.counters()
            self._renew()
            self._restore(moment.held)
            self._count_on(counted)

    def counters(self) -> dict[str, int]:
        """Return the counts since it was made or reset.

        These are exchanges, moves_started, tool_writes, starts and touches.
        """
        with self.lock:
            counted = self._counted()
            before = self._counted_before
            since = {name: count + before.get(name, 0) for name, count in counted.items()}
            return {"exchanges": self.exchanges, **since}

    def motions(self, after: int = 0) -> Iterator[StartedMotion]:
        """Yield the motions that began, without the first ``after`` ones.

        Those before it went back to an earlier moment are counted, and held no longer.
        """
        before = self._counted_before.get("moves_started", 0)
        for motion in self._motion_log().motions(after - before):
            yield replace(motion, number=motion.number + before) if before else motion

    @property
    def executes_program(self) -> bool:
        """Whether it executes a loaded program, whose variables no snapshot contains."""
        return False

    @property
    def failure(self) -> StateNotKeptError | None:
        """Why it can no longer store its state; the server then ends it."""
        return None

    @property
    @abstractmethod
    def machine_name(self) -> str:
        """Kind and model."""

    @abstractmethod
    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``, stopping wherever something changes."""

    @abstractmethod
    def restart(self) -> None:
        """Switch off and on; what it retains stays."""

    @abstractmethod
    def _counted(self) -> dict[str, int]:
        """Return the counts of its parts: moves_started, tool_writes, starts, touches."""

    @abstractmethod
    def _motion_log(self) -> MotionLog:
        """Return the log of its robots' motions."""

    @abstractmethod
    def _truth(self) -> dict[str, Any]:
        """Return the true state."""

    @abstractmethod
    def _renew(self) -> None:
        """Cut the links and make everything anew."""

    @abstractmethod
    def _moment(self) -> dict[str, Any]:
        """Return copies of the state for a restore."""

    @abstractmethod
    def _restore(self, held: Mapping[str, Any]) -> None:
        """Restore what :meth:`_moment` returned."""

    def _count_on(self, counted: Mapping[str, int] = NEW) -> None:
        """Continue from these counts, whatever its parts have counted."""
        self._counted_before = {
            name: counted[name] - count for name, count in self._counted().items()
        }

    def _after_act(self) -> None:  # noqa: B027 - most have nothing to do
        """Do what is due after an act from outside the wire."""

    def _require_renewable(self) -> None:
        if self.durable:
            raise NotNowError(
                tr("A simulator that keeps its state in a file cannot be rebuilt."),
                remedy=tr("Restart it, or start another one without a file."),
            )
        if self.executes_program:
            raise NotNowError(
                tr("A simulator that executes a program cannot be rebuilt."),
                remedy=tr("Restart it instead."),
            )


Act = Callable[[], None]


class PlannedActs(ABC):
    """Planned disturbances around a controller, each at its own instant."""

    def __init__(self) -> None:
        self._planned: list[tuple[int, Act]] = []

    def strike(self, faults: Sequence[Any], now_ns: int) -> None:
        """Do what is due now, and note what comes later."""
        for fault in faults:
            act = self._act_of(fault)
            if act is not None:
                self.plan(now_ns, fault.seconds, act)

    @abstractmethod
    def plan(self, now_ns: int, seconds: float, act: Act) -> None:
        """Plan an act some time from now."""

    @abstractmethod
    def _act_of(self, fault: Any) -> Act | None:  # noqa: ANN401 - of the kind of controller
        """Return the act of a fault, if it is one of this kind."""

    def plan_at(self, at_ns: int, act: Act) -> None:
        """Plan an act at an instant."""
        self._planned.append((at_ns, act))

    def next_change(self) -> int | None:
        """Return when the next one is due."""
        return min(at_ns for at_ns, _ in self._planned) if self._planned else None

    def carry_out(self, now_ns: int) -> None:
        """Do what is due by now."""
        if not self._planned:
            return
        due = [act for at_ns, act in self._planned if at_ns <= now_ns]
        self._planned = [plan for plan in self._planned if plan[0] > now_ns]
        for act in due:
            act()

    def forget(self) -> None:
        """Remove all plans."""
        self._planned.clear()
