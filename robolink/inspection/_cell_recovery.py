"""Recovery of a cell as one call: connect, finish or undo what was interrupted, log out."""

from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from typing import ClassVar

from robolink.config import Cell, connect_cell
from robolink.controllers import connect as connect_url
from robolink.errors import ControllerError
from robolink.messages import tr
from robolink.model import (
    AnsweredBy,
    Controller,
    Finding,
    MarkerKind,
    Signature,
    answer_entry,
)
from robolink.stopping import StopListener
from robolink.timing import NS_PER_S, SystemClock
from robolink.transaction import recover


@dataclass(frozen=True, slots=True)
class CellRecovery:
    """What a recovery of a cell found and did.

    Attributes:
        cell: Its name, or its URL where it has none.
        settled: What is closed now: its verdict says as what, its action what was done for it.
        left: What only a person can judge, and nobody did; the robot stays blocked.
        selected_tool: The tool that is selected now; ``None`` where that could not be read.
        seconds: How long it took.
    """

    json_version: ClassVar[int] = 1
    cell: str
    settled: tuple[Finding, ...]
    left: tuple[Finding, ...]
    selected_tool: int | None
    seconds: float = field(compare=False)

    @property
    def recovered(self) -> bool:
        """Whether nothing is left unfinished."""
        return not self.left


def recover_cell(
    cell: Cell | str | Controller,
    *,
    keep: bool = False,
    judge: Callable[[Finding], bool] | None = None,
    answered_by: AnsweredBy | None = AnsweredBy.PROGRAM,
    tell: Callable[[Finding, bool], None] = lambda _finding, _settled: None,
    later: Collection[str] = (),
    connect: Callable[[Cell | str], Controller] | None = None,
    signature: Signature | None = None,
    wait_s: float = 0.0,
) -> CellRecovery:
    """Finish or undo the interrupted jobs of a cell, as ``robolink recover`` without a terminal.

    It reads first, writes each tool at most once, and moves nothing. A stop from another terminal
    reaches the cell meanwhile.

    Args:
        cell: The cell, its name, the URL of a controller, or a controller that is open already: it
            stays so, and whoever opened it lets a stop reach it.
        keep: Whether new values that nobody tested stay; else the old ones are restored.
        judge: Asked about each finding that reading cannot settle: true only where somebody has
            looked at the robot, and work may go on. By default such a finding is left.
        answered_by: As whose answer each yes goes on record; ``None`` where ``judge`` keeps it.
        tell: Told of each finding, and whether it is settled.
        later: Operations of markers that are left alone: the caller settles them.
        connect: How the cell is connected to; by default as its file says, and a URL as it is.
        signature: Who recovers; by default the user of this computer.
        wait_s: How long to wait for somebody else who has the controller.

    Raises:
        ConfigError: There is no such cell, a cell file is wrong, or the journal cannot be used.
        BusyError: Somebody is working on the controller.
        StoppedError: A stop came.
        RobolinkError: It was not reached, or a step failed; the rest stays open, and the call may
            be repeated.

    Example:
        >>> from robolink.inspection import recover_cell
        >>> recover_cell("epson+sim://recover-cell-example").left
        ()
    """
    clock = SystemClock()
    begun_ns = clock.now_ns()
    with ExitStack() as stack:
        controller = (
            stack.enter_context(_opened(cell, connect or _connecting(signature, wait_s)))
            if isinstance(cell, (Cell, str))
            else cell
        )

        def confirm(finding: Finding) -> bool:
            if judge is None or not judge(finding):
                return False
            if answered_by is not None:
                _keep_yes(controller, finding, answered_by)
            return True

        found = recover(controller, keep=keep, confirm=confirm, tell=tell, later=later)
        selected: int | None = None
        with suppress(ControllerError):  # a controller without an answer has no selected tool
            selected = controller.tools.selected()
    called = cell.name if isinstance(cell, Cell) else controller.identity
    name = cell if isinstance(cell, str) else called
    seconds = (clock.now_ns() - begun_ns) / NS_PER_S
    return CellRecovery(name, found.settled, found.left, selected, seconds)


@contextmanager
def _opened(cell: Cell | str, connect: Callable[[Cell | str], Controller]) -> Iterator[Controller]:
    """Connect to a cell for the block, and let a stop from another terminal reach it."""
    controller = connect(cell)
    with controller, controller.latch.ending(tr("recover")), ExitStack() as stack:
        url = controller.identity
        if "+sim://" not in url:
            who = tr("{who} (recover)", who=controller.outcomes.signature.os_user or "?")
            identity = controller.outcomes.identity
            stack.enter_context(StopListener(controller, url, who=who, name=identity))
        yield controller


def _keep_yes(controller: Controller, finding: Finding, by: AnsweredBy) -> None:
    question = tr("Is that right, and can work continue?")
    answer = answer_entry(f"{finding.sentence} {question}", True, by)
    if finding.marker.kind is MarkerKind.HISTORY:
        controller.outcomes.answered(answer)  # stored where the new record begins
    else:
        controller.outcomes.append(answer)


def _connecting(signature: Signature | None, wait_s: float) -> Callable[[Cell | str], Controller]:
    def connect(cell: Cell | str) -> Controller:
        if isinstance(cell, str) and "://" in cell:
            return connect_url(cell, signature=signature, wait_s=wait_s)
        return connect_cell(cell, signature=signature, wait_s=wait_s)

    return connect
