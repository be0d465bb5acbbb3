"""An operator in a separate process, who waits before each step for permission."""

import os
import signal
import sys
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from robolink_simulators.cell.clock import ManualClock

import robolink
from robolink.errors import RobolinkError
from robolink.journal import open_journal
from robolink.model import Signature, ToolOffset
from robolink.timing import NS_PER_S
from robolink.transaction import Wanted, change_tools
from tests._patience import PATIENCE_S
from tests.faults import _client_process
from tests.faults._operator_steps import StepKind, Waiting, wait_at_each_step


@dataclass(frozen=True)
class Ended:
    """How the operator ended: ``done``, or the kind of error and its sentences."""

    how: str
    said: str = ""


class OperatorProcess:
    """Reads tools, then changes them if they still hold the values read.

    Args:
        url: The controller.
        folder: The folder of the journal.
        name: The operator's name.
        wanted: The intended values of the tools.
        stepwise: Whether to wait before each step.
        later_s: How much the operator's clock is ahead.
    """

    def __init__(
        self,
        url: str,
        folder: Path,
        name: str,
        wanted: dict[int, ToolOffset],
        *,
        stepwise: bool = True,
        later_s: float = 0.0,
    ) -> None:
        forks = _client_process._FORKS
        self._line, far_end = forks.Pipe()
        task = (url, str(folder), name, wanted, later_s)
        self._process = forks.Process(target=_operate, args=(far_end, task, stepwise), daemon=True)
        self._process.start()
        far_end.close()
        self.state: Waiting | Ended | None = None
        if stepwise:
            self._listen()

    def step(self) -> None:
        """Permit the next step; return at the one after it, or at the end."""
        assert isinstance(self.state, Waiting), f"there is no further step: {self.state}"
        self._line.send(None)
        self._listen()

    def advance_to(self, kind: StepKind, *, count: int = 1) -> None:
        """Permit steps up to the ``count``-th step of a kind."""
        while True:
            assert isinstance(self.state, Waiting), f"he did not come to a {kind}: {self.state}"
            if self.state.kind == kind:
                count -= 1
            if not count:
                return
            self.step()

    def end(self) -> Ended:
        """Permit all steps to the end."""
        while not isinstance(self.state, Ended):
            if isinstance(self.state, Waiting):
                self._line.send(None)
            self._listen()
        self.close()
        return self.state

    def freeze(self) -> None:
        """Send SIGSTOP."""
        self._signal(signal.SIGSTOP)

    def thaw(self) -> None:
        """Send SIGCONT."""
        self._signal(signal.SIGCONT)

    def close(self) -> None:
        """End the process, whatever its state."""
        self._process.kill()
        self._process.join()
        self._process.close()
        self._line.close()

    def _listen(self) -> None:
        assert self._line.poll(PATIENCE_S), "he hangs"
        self.state = self._line.recv()

    def _signal(self, number: signal.Signals) -> None:
        assert self._process.pid is not None
        os.kill(self._process.pid, number)


def _operate(
    line: Connection, task: tuple[str, str, str, dict[int, ToolOffset], float], stepwise: bool
) -> None:
    url, folder, name, wanted, later_s = task
    clock = ManualClock(round(later_s * NS_PER_S))
    signature = Signature(operator=name)
    os.environ["ROBOLINK_STATE_DIR"] = folder  # a PC of its own, in the place of the folder
    outcomes = open_journal(f"{folder}/journal.db").log(url, signature=signature, clock=clock)
    try:
        with robolink.connect(url, outcomes=outcomes, timeout_s=PATIENCE_S) as controller:
            if stepwise:
                wait_at_each_step(line, outcomes)
            found = {tool: controller.tools.read(tool) for tool in wanted}
            change_tools(
                controller, [Wanted(tool, wanted[tool], value) for tool, value in found.items()]
            )
    except RobolinkError as error:
        line.send(Ended(type(error).__name__, str(error)))
    else:
        line.send(Ended("done"))
    sys.exit(0)
