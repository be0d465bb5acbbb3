"""A simulated cell as a test gets it: made, served, looked at, put back."""

import os
import subprocess
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.control.cell import AnySimulator, ControlledCell
from robolink_simulators.device.wire_record import WireRecord
from robolink_simulators.testkit.looks import MotionLook, WireLook
from robolink_simulators.testkit.operator import ScriptedOperator

_COMMAND_S: Final = 120.0
_IN_PROCESS: Final = ("+sim://", "interface=virtual")
"""In the URL of what no other process reaches: a simulator, or a CAN bus, in the memory of this
one. A command would make another simulator of the same name, and work on that."""

_FIRST: Final = "as it was given to the test"

MOST_LINES: Final = 200_000
"""So many lines of its wire are held: what counts requests must not have lost one."""


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
        """Put a person there, and keep the moment for :meth:`put_back`."""
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
        """Return what is really so: the tips, the pin, what the controller holds."""
        truth: dict[str, Any] = self.simulator.truth()
        return truth

    def do(self, act: str, **given: object) -> dict[str, object]:
        """Do an act of the control API, and return what it gives; see docs/control-api.md."""
        return self.operator.do(act, **given)

    def snapshot(self, name: str) -> None:
        """Keep what controller and world are now."""
        self.do("snapshot", name=name)

    def restore(self, name: str) -> None:
        """Be again what was kept."""
        self.do("restore", name=name)

    def put_back(self) -> None:
        """Be as at first, the same controller: no faults, script, log or counts. Between tests."""
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
                    "Ask for one on a port, for example by epson_tcp, epson_cell, "
                    "softmotion_cell, or a factory with medium=."
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
        """The options by which a command asks this person, and asks nobody else.

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
    """Where a factory puts what it serves, and closes it at the end.

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
        simulator.log = WireRecord(MOST_LINES)  # nobody has asked it anything yet
        controlled = ControlledCell(simulator, clock, urls)
        url = next(iter(urls.values()))
        cell = SimulatedCell(
            url, simulator, controlled, assist=assist, recipe=recipe, left_out=self.left_out
        )
        self.cells.append(cell)
        return cell
