"""What a test asserts about the wire and about motions; each message shows what there was."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from robolink.timing import NS_PER_S
from robolink_simulators.control.cell import AnySimulator
from robolink_simulators.device.motion_log import StartedMotion
from robolink_simulators.device.wire_record import WireLine

_SHOWN: Final = 40


@dataclass(frozen=True, slots=True)
class WireLook:
    """What crossed the wire of a simulated controller, passwords hidden.

    Args:
        simulator: Whose.
    """

    simulator: AnySimulator

    @property
    def lines(self) -> tuple[WireLine, ...]:
        """Requests and answers, oldest first."""
        with self.simulator.lock:
            return tuple(self.simulator.log.lines())

    @property
    def requests(self) -> tuple[str, ...]:
        """What clients sent."""
        return tuple(line.text for line in self.lines if line.direction == ">")

    def sent(self, text: str) -> int:
        """Return how many requests contain a text; upper and lower case are told apart.

        Raises:
            AssertionError: The log is not whole any more, so that none knows how many.
        """
        __tracebackhide__ = True
        lines = self.lines
        if lines and lines[0].number > 1:
            raise AssertionError(
                f"Only the last {len(lines)} lines of the wire are held: look earlier, "
                f"or put the cell back in between."
            )
        return sum(text in line.text for line in lines if line.direction == ">")

    def assert_sent(self, text: str, times: int | None = None) -> None:
        """Fail unless a text was sent, and exactly so often where ``times`` says it.

        Raises:
            AssertionError: It was not; shows the last requests.
        """
        __tracebackhide__ = True
        found = self.sent(text)
        as_wanted = found > 0 if times is None else found == times
        if not as_wanted:
            wanted = "" if times is None else f", not {times} times"
            raise AssertionError(f"{text!r} was sent {found} times{wanted}.\n{self.shown()}")

    def assert_not_sent(self, text: str) -> None:
        """Fail if a text was sent.

        Raises:
            AssertionError: It was; shows the last requests.
        """
        __tracebackhide__ = True
        if found := self.sent(text):
            raise AssertionError(f"{text!r} was sent {found} times.\n{self.shown()}")

    def shown(self, most: int = _SHOWN) -> str:
        """Return the last lines for a person."""
        return listed(
            (
                f"{line.at_ns / NS_PER_S:10.3f} s {line.direction} {line.text}"
                for line in self.lines
            ),
            most,
        )


@dataclass(frozen=True, slots=True)
class MotionLook:
    """The motions that began, whoever commanded them and over which link.

    Args:
        simulator: Whose.
    """

    simulator: AnySimulator

    @property
    def started(self) -> tuple[StartedMotion, ...]:
        """Each with its instant, robot, and where the flange was to end; the last 2,000."""
        with self.simulator.lock:
            return tuple(self.simulator.motions())

    @property
    def count(self) -> int:
        """How many began since the simulator was made or reset."""
        with self.simulator.lock:
            return self.simulator.counters()["moves_started"]

    def assert_none(self) -> None:
        """Fail if any motion was commanded.

        Raises:
            AssertionError: There was one; shows them.
        """
        __tracebackhide__ = True
        if self.count:
            raise AssertionError(f"{self.count} motions began.\n{self.shown()}")

    def shown(self, most: int = _SHOWN) -> str:
        """Return the last motions for a person."""
        return listed(
            (
                f"{one.at_ns / NS_PER_S:10.3f} s {one.kind} {one.number}{_robot(one)} {_place(one)}"
                for one in self.started
            ),
            most,
        )


def _robot(motion: StartedMotion) -> str:
    return f" robot {motion.robot}" if motion.robot > 1 else ""


def _place(motion: StartedMotion) -> str:
    if motion.flange_mm is None:
        return "by buttons"
    return "to {:.3f} {:.3f} {:.3f}".format(*motion.flange_mm)


def listed(lines: Iterable[str], most: int) -> str:
    """Return the last of some lines, and how many stood before them."""
    every = list(lines)
    left_out = len(every) - most
    head = [f"({left_out} before)"] if left_out > 0 else []
    return "\n".join(head + every[-most:])
