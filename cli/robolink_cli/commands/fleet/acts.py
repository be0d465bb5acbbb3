"""What an agent does at a cell, by the kind of a plan: nothing of it moves a robot.

Each act is under the order of its job, so that it is carried out once however often it is
delivered. This computer is the home of the cells that its cell files name: what is changed there is
in its journal.
"""

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from robolink import errors
from robolink.errors import BusyError, ConfigError, RobolinkError
from robolink.fleet import JobOutcome, Permit, Plan, PlanKind
from robolink.fleet.errors import PlanError
from robolink.interrupts import ClosedAtExit
from robolink.messages import in_english, joined, known_names, tr
from robolink_cli.console.exit_codes import DIFFERENT, DONE, exit_code, exit_code_of

if TYPE_CHECKING:
    from robolink.config import Cell, CellFiles
    from robolink.model import Controller, Signature
    from robolink.stopping import SharedStopListener


class _Job(NamedTuple):
    """A job at its cell.

    Attributes:
        plan: The plan.
        cell: The cell, as its files say now.
        permit: By which permit; ``None`` for a job that changes nothing, or may not any more.
        keep_days: For how many days checks are kept.
        listener: Hears a stop from another terminal; ``None`` where that cannot be.
    """

    plan: Plan
    cell: "Cell"
    permit: Permit | None
    keep_days: int
    listener: "SharedStopListener | None" = None

    @property
    def order(self) -> str:
        """The id of its order."""
        return self.plan.order(self.cell.name)

    def signature(self) -> "Signature":
        """Return in whose name it is carried out: of a change, who has the permit.

        Raises:
            ConfigError: The cell names people, and whoever has the permit is none of them.
        """
        from robolink_cli.session.operator_identity import signature_of

        if self.permit is not None:
            return signature_of(self.permit.person, self.cell.expected, changes=False)
        return signature_of(None, None, changes=False)

    @contextmanager
    def connected(self) -> "Iterator[Controller]":
        """Connect to the controller, as a command does that nobody watches; a stop reaches it.

        Raises:
            RobolinkError: It is not reached, is not the one that the cell file names, was stopped,
                or what is done could not be recorded.
        """
        with self.connect() as controller, controller.latch.ending(tr("The job")):
            outcomes = controller.outcomes
            if outcomes.trouble is not None:
                raise outcomes.trouble
            with (
                nullcontext()
                if self.listener is None
                else self.listener.listening(controller, self.cell.url, name=outcomes.identity)
            ):
                yield controller
        controller.latch.require_open(tr("The job"))  # a stop came while it was closing

    def connect(self) -> "Controller":
        """Return the connected controller."""
        from robolink.config import connect_cell

        return connect_cell(self.cell, signature=self.signature())


class CellActs(ClosedAtExit):
    """Carries out the jobs of plans; each call comes from a thread of its own.

    While it has a controller, ``robolink stop`` in another terminal reaches that.

    Args:
        backups: Folder of the backups: in it a folder a plan, in that a file a cell.
        tell: Receives sentences for people.
    """

    def __init__(
        self, backups: Path, *, tell: Callable[[str], None] = lambda _sentence: None
    ) -> None:
        self._backups = backups
        self._listener = _listener(tell)
        self._reading = threading.Lock()
        self._files: CellFiles | None = None
        self._as_of: tuple[tuple[int, int], ...] | None = None
        self._kinds: Final[Mapping[PlanKind, Callable[[_Job], JobOutcome]]] = {
            PlanKind.BACKUP: self._back_up,
            PlanKind.CHECK: _check,
            PlanKind.DRIFT: _drift,
            PlanKind.OFFSET: _write_offset,
        }

    def close(self) -> None:
        """Hear no more stops."""
        if self._listener is not None:
            self._listener.close()

    def __call__(self, plan: Plan, cell: str, permit: Permit | None) -> JobOutcome:
        """Carry out the job of a plan at a cell; whatever happens is an outcome."""
        try:
            found, keep_days = self._cell(cell)
            return self._kinds[plan.kind](_Job(plan, found, permit, keep_days, self._listener))
        except Exception as error:  # a defect is told, too, and ends one job
            return outcome_of(error)

    def _cell(self, name: str) -> "tuple[Cell, int]":
        """Return a cell as the files say now, and for how many days checks are kept.

        Raises:
            ConfigError: There is no such cell, or a cell file is wrong.
        """
        from robolink.config import config_files, load_cell_files, use_journals_of

        with self._reading:  # once, however many jobs begin together
            now = tuple(_state_of(file.path) for file in config_files())
            if self._files is None or now != self._as_of:
                self._files, self._as_of = load_cell_files(), now
                use_journals_of(self._files.cells.values(), self._files.journal)
            files = self._files
        cells = files.cells
        if name not in cells:
            raise ConfigError(
                tr("This computer has no cell {name}.", name=name),
                remedy=known_names(tuple(cells), name),
            )
        return cells[name], files.keep_checks_days

    def _back_up(self, job: _Job) -> JobOutcome:
        """Save all tools in a file; the one that this order saved before stays as it is."""
        from robolink.backup import load, save, take_backup
        from robolink.files.durable import file_name, make_folder

        file = self._backups / job.plan.id / file_name(job.cell.name)
        if file.exists():
            load(file)  # whole, since it was renamed into place
        else:
            with job.connected() as controller:
                taken = take_backup(controller)
            try:
                make_folder(file.parent)
                save(taken, file, replace=True)
            except (OSError, ConfigError) as error:  # no cell's fault: the plan halts
                raise PlanError(
                    tr("No backup can be saved in {path}: {cause}.", path=file.parent, cause=error),
                    remedy=tr("Nothing was written to the cell. Give --backups another folder."),
                ) from error
        return JobOutcome(DONE, what=f"Saved in {file}.")


def _check(job: _Job) -> JobOutcome:
    """Look for unexpected changes and overdue checks, and put that on record."""
    from robolink.inspection import check_cells

    (check,) = check_cells(
        [job.cell],
        connect=lambda _cell: job.connect(),
        signature=job.signature(),
        keep_days=job.keep_days,
    )
    if check.failure is not None:
        kind = getattr(errors, check.failure.kind, RobolinkError)
        what = in_english(check.failure.what)
        return JobOutcome(exit_code_of(kind), error=check.failure.kind, what=what)
    assert check.inspection is not None  # noqa: S101 - of a check that was made
    return _found([one.sentence for one in check.inspection.findings])


def _drift(job: _Job) -> JobOutcome:
    """Read from the record what the charts of a cell show; no controller is asked."""
    from robolink.drift import KINDS, drift_of
    from robolink.journal import open_log
    from robolink.methods import all_methods
    from robolink.transport import parse_url

    address = parse_url(job.cell.url).address
    log = open_log(address, durable=True, signature=job.signature(), glance=True)
    try:
        newest_first = list(log.recorded(kinds=KINDS))
    finally:
        log.close()
    finding = {method.name for method in all_methods() if method.needs.finds_pin}
    drift = drift_of(address, reversed(newest_first), finds_pin=finding.__contains__)
    return _found([one.sentence for one in drift.findings])


def _write_offset(job: _Job) -> JobOutcome:
    """Write what the plan says into a tool, once; nothing is proved by it."""
    from robolink.backup import keep_first_backup
    from robolink.model import ToolOffset
    from robolink.transaction import Wanted, carrying_out, change_tools

    said = dict(job.plan.offsets[job.cell.name])
    tool = int(said.pop("tool"))
    with (
        job.connected() as controller,
        carrying_out(controller, job.order, {"command": "fleet", "tool": tool, **said}) as order,
    ):
        if order.done is not None:
            return JobOutcome(DONE, what="Written before.", change=order.done.change)
        if job.permit is None:
            raise BusyError(
                tr("Nothing was written: the plan may not begin anything now."),
                remedy=tr("It is tried again when the plan may go on."),
            )
        controller.tools.require_writable(tool)
        before = controller.tools.read(tool)
        kept = ToolOffset() if before is None or before.of_no_tool else before
        keep_first_backup(controller, tell=lambda _sentence: None)
        wanted = Wanted(tool, replace(kept, **said), before)
        change_tools(controller, [wanted], order=order)
        return JobOutcome(DONE, what="Written and read back.")


def _listener(tell: Callable[[str], None]) -> "SharedStopListener | None":
    """Return what hears stops from other terminals; ``None`` where that cannot be."""
    from robolink.journal import this_process
    from robolink.stopping import SharedStopListener

    who = this_process().os_user or "?"
    try:
        return SharedStopListener(
            who=tr("{who} (plans of many cells)", who=who),
            heard=lambda url, by: tell(
                tr("{url}: stopped from another terminal by {who}.", url=url, who=by)
            ),
        )
    except OSError as error:
        tell(
            tr(
                "'robolink stop' in another terminal cannot reach this command: {cause}.",
                cause=error.strerror or error,
            )
        )
        return None


def outcome_of(error: BaseException) -> JobOutcome:
    """Return what an error means for a job."""
    what = getattr(error, "what", "") or f"{type(error).__name__}: {error}"
    reason = getattr(error, "reason", None)
    return JobOutcome(
        exit_code(error),
        error=type(error).__name__,
        reason="" if reason is None else str(reason),
        what=in_english(what),
    )


def _found(sentences: list[str]) -> JobOutcome:
    """Return the outcome of a look."""
    what = in_english(joined(" ", sentences)) if sentences else "No problem found."
    return JobOutcome(DIFFERENT if sentences else DONE, what=what)


def _state_of(path: Path) -> tuple[int, int]:
    """Return what changes with a file; a missing one has a state, too."""
    try:
        found = path.stat()
    except OSError:
        return (0, 0)
    return (found.st_mtime_ns, found.st_size)
