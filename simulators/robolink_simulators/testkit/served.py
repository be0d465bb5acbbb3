"""A simulated cell as a test gets it: made, served, observed, restored."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.timing import NS_PER_S
from robolink_simulators.control.cell import AnySimulator, ControlledCell
from robolink_simulators.device.wire_record import StartedMotion, WireLine, WireRecord
from robolink_simulators.testkit.operator import ScriptedOperator

__all__ = ["EndedCommand", "MotionLook", "SimulatedCell", "WireLook"]

_SHOWN: Final = 40


@dataclass(frozen=True, slots=True)
class WireLook:
    """The traffic of a simulated controller, passwords hidden.

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
        """Return how many requests contain a text; case matters.

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
        """Fail unless a text was sent, and exactly ``times`` times if given.

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


_COMMAND_S: Final = 120.0
_IN_PROCESS: Final = ("+sim://", "interface=virtual")
"""Marks of a URL that no other process can reach: a simulator or a CAN bus in the memory of this
process. A command would create and use another simulator of the same name.
"""

_FIRST: Final = "as it was given to the test"

MOST_LINES: Final = 200_000
"""Number of wire lines that are kept, so that counts of requests are complete."""


@dataclass(frozen=True)
class SimulatedCell:
    """A simulated controller, its world, and the person there.

    Attributes:
        url: Where to connect to.
        simulator: The device; hold its ``lock`` while touching it.
        controlled: The same, for acts of the control API.
        assist: ``assist+tcp://TOKEN@127.0.0.1:PORT``, or the URL itself in the process:
            through it robolink sees and asks the person. ``None`` where nobody was asked for.
        recipe: A recipe for the pin of the cell, by two poses: for an arm that can turn its
            tool. ``None`` where none was asked for.
        left_out: Variables of the environment that :meth:`run` hands on only where they hold
            something else by then.
        wire: What crossed the wire.
        motions: What was moved.
        operator: The person, who follows a script.
    """

    url: str
    simulator: Any
    controlled: ControlledCell
    assist: str | None = None
    recipe: Path | None = None
    left_out: Mapping[str, str] = field(default_factory=dict)
    operator: ScriptedOperator = field(init=False)

    def __post_init__(self) -> None:
        """Add a person, and store the state for :meth:`put_back`."""
        object.__setattr__(self, "operator", ScriptedOperator(self.controlled))
        if not self.simulator.durable:
            self.controlled.moments[_FIRST] = self.simulator.kept_moment()

    @property
    def wire(self) -> WireLook:
        """See above."""
        return WireLook(self.simulator)

    @property
    def motions(self) -> MotionLook:
        """See above."""
        return MotionLook(self.simulator)

    @property
    def clock(self) -> Any:  # noqa: ANN401 - stepped in the process, steered on a port
        """The simulated time."""
        return self.controlled.clock

    def truth(self) -> dict[str, Any]:
        """Return the true state: the tips, the pin, what the controller holds."""
        truth: dict[str, Any] = self.simulator.truth()
        return truth

    def do(self, act: str, **given: object) -> dict[str, object]:
        """Carry out an act of the control API, and return its result; see docs/control-api.md."""
        return self.operator.do(act, **given)

    def snapshot(self, name: str) -> None:
        """Store the present state of controller and world."""
        self.do("snapshot", name=name)

    def restore(self, name: str) -> None:
        """Restore a stored state."""
        self.do("restore", name=name)

    def put_back(self) -> None:
        """Restore the first state of the same controller: no faults, script, log or counts."""
        self.operator.forget()
        self.restore(_FIRST)
        self.simulator.forget_past()

    def run(self, *arguments: str, timeout_s: float = _COMMAND_S) -> "EndedCommand":
        """Run robolink on this cell, in a process of its own: ``run("change", str(recipe))``.

        It is told where the person is where it takes ``--assist``: give ``*cell.by_hand`` then.
        Of the environment it finds what the test set, and nothing that robolink was told before
        pytest began: a password or a language of the tester's own is for another cell.

        Args:
            arguments: Of the command, behind ``robolink --json -c URL``.
            timeout_s: Longest wait for its end.

        Raises:
            ConfigError: The cell lives in the process of the test, where no other one reaches it.
            subprocess.TimeoutExpired: It did not end in time; it was killed.
        """
        if any(mark in self.url for mark in _IN_PROCESS):
            raise ConfigError(
                tr("This cell lives in the process of the test; a command is another process."),
                remedy=tr(
                    "Ask for one on a port, for example with epson_cell or a factory with medium=."
                ),
            )
        done = subprocess.run(
            [sys.executable, "-m", "robolink_cli", "--json", "-c", self.url, *arguments],
            env=self._environment(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
        )
        return EndedCommand(done.returncode, done.stdout, done.stderr)

    def _environment(self) -> Mapping[str, str]:
        found = {
            name: value for name, value in os.environ.items() if self.left_out.get(name) != value
        }
        return {**found, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}

    @property
    def by_hand(self) -> tuple[str, ...]:
        """The options by which a command asks this person, and nobody else.

        Raises:
            ConfigError: There is none.
        """
        if self.assist is None:
            raise ConfigError(
                tr("There is no person at this cell."),
                remedy=tr("Take epson_cell or softmotion_cell, or a factory with person=True."),
            )
        return ("--assist", str(self.assist), "--yes")


@dataclass(frozen=True, slots=True)
class EndedCommand:
    """How a command ended.

    Attributes:
        exit_code: See docs/commands.md.
        out: What it printed: one document with --json.
        messages: What it told a person meanwhile.
    """

    exit_code: int
    out: str
    messages: str


@dataclass(frozen=True, slots=True)
class OwnFolder:
    """Where a factory keeps its served cells, and closes them at the end.

    Attributes:
        stack: Closed at the end of the test.
        folder: Of the test.
        seed: Of the test run.
        cells: What was made, for the report of a test that fails.
        left_out: See :class:`SimulatedCell`.
    """

    stack: ExitStack
    folder: Path
    seed: int
    cells: list[SimulatedCell]
    left_out: Mapping[str, str] = field(default_factory=dict)

    def keep(
        self,
        simulator: AnySimulator,
        clock: Any,  # noqa: ANN401 - stepped or steered
        urls: Mapping[str, str],
        *,
        assist: str | None = None,
        recipe: Path | None = None,
    ) -> SimulatedCell:
        """Return the cell of a simulator that is served, and remember it."""
        simulator.log = WireRecord(MOST_LINES)  # no request has been made yet
        controlled = ControlledCell(simulator, clock, urls)
        url = next(iter(urls.values()))
        cell = SimulatedCell(
            url, simulator, controlled, assist=assist, recipe=recipe, left_out=self.left_out
        )
        self.cells.append(cell)
        return cell


_SHOWN_LINES = 200


def sections_of(cells: Iterable[SimulatedCell]) -> list[tuple[str, str]]:
    """Return heading and text of what is attached for some cells."""
    sections = []
    for cell in cells:
        simulator = cell.simulator
        with simulator.lock:
            head = f"{simulator.machine_name}, seed {simulator.seed}, {cell.url}"
            state = {
                "simulated_s": simulator.now_ns / NS_PER_S,
                "counters": simulator.counters(),
                "faults": cell.do("faults"),
                "truth": simulator.truth(),
            }
            wire, motions = cell.wire.shown(_SHOWN_LINES), cell.motions.shown()
        sections += [
            (f"robolink wire: {head}", wire or "(nothing crossed the wire)"),
            (f"robolink motions: {head}", motions or "(nothing moved)"),
            (f"robolink state: {head}", json.dumps(state, indent=1)),
        ]
    return sections
