"""What an agent does at a cell, by the kind of a plan: nothing of it moves a robot.

Each act is under the order of its job, so that it is carried out once however often it is
delivered. This computer is the home of the cells that its cell files name, unless they say
otherwise: what is changed there is in its journal.
"""

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from robolink import errors
from robolink.errors import BusyError, ConfigError, JournalError, RobolinkError, StoppedError
from robolink.fleet import JobOutcome, Permit, Plan, PlanKind
from robolink.fleet.errors import PlanError
from robolink.fleet.silence import hanging
from robolink.interrupts import ClosedAtExit
from robolink.messages import in_english, joined, known_names, tr
from robolink_cli.console.exit_codes import DIFFERENT, DONE, exit_code_of
from robolink_cli.session.cell_plans import ends_order, kept_before, outcome_of

if TYPE_CHECKING:
    from robolink.config import Cell, CellFiles
    from robolink.model import Controller, Signature
    from robolink.stopping import SharedStopListener
    from robolink.transaction import Order


class _Job(NamedTuple):
    """A job at its cell.

    Attributes:
        plan: The plan.
        cell: The cell, as its files say now.
        permit: By which permit; ``None`` for a job that changes nothing, or may not any more.
        keep_days: For how many days checks are kept.
        line: Its connection, as those see it who watch the job.
        listener: Hears a stop from another terminal; ``None`` where that cannot be.
    """

    plan: Plan
    cell: "Cell"
    permit: Permit | None
    keep_days: int
    line: "_Line"
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
        """Return the connected controller.

        Raises:
            JournalError: The job was cut off meanwhile.
        """
        from robolink.config import connect_cell

        controller = connect_cell(self.cell, signature=self.signature())
        self.line.controller = controller  # before the look: who cuts it off does so the other way
        if self.line.cut:
            controller.close()
            raise _was_cut_off()
        return controller

    @contextmanager
    def not_cut_off(self) -> Iterator[None]:
        """Have a job that was cut off, and wakes up, close no order: nobody decided about it.

        Raises:
            JournalError: It was cut off.
        """
        try:
            yield
        except StoppedError as error:
            if not self.line.cut:
                raise
            raise _was_cut_off() from error


@dataclass(slots=True)
class _Line:
    """The connection of a job.

    Attributes:
        writes: Whether the job changes something.
        controller: The controller, from when it is connected.
        cut: Whether the job was cut off from it.
    """

    writes: bool
    controller: "Controller | None" = None
    cut: bool = False

    def cut_off(self, ended: Callable[[JobOutcome | None], None]) -> None:
        """Let nothing reach the controller any more; see :class:`robolink.fleet.silence.CellLine`.

        One that is only read is not stopped: production may run there.
        """
        self.cut = True
        controller = self.controller
        if controller is None:
            ended(hanging(writes=False, settled=True, at_rest=True))  # nothing was sent
            return
        at_rest = not self.writes
        controller.latch.sever()
        with suppress(RobolinkError):
            if self.writes:
                controller.stop()
                at_rest = True
        settled = controller.ledger.outcome().settled
        ended(hanging(writes=self.writes, settled=settled, at_rest=at_rest))
        controller.close()  # the connection first, for others; then its record, which may hang


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
        self._lines: dict[str, _Line] = {}
        self._tell, self._told = tell, set[str]()
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
        line = self._lines[plan.order(cell)] = _Line(writes=not plan.kind.reads)
        try:
            found, keep_days = self._cell(cell)
            found.home.require_here()
            self._say_how_protected(found)
            job = _Job(plan, found, permit, keep_days, line, self._listener)
            return self._kinds[plan.kind](job)
        except Exception as error:  # a defect is told, too, and ends one job
            return outcome_of(error)
        finally:
            del self._lines[plan.order(cell)]

    def _say_how_protected(self, cell: "Cell") -> None:
        """Say, once a cell, where its connection is less protected than it could be."""
        if "+opcua://" in cell.url and cell.url not in self._told:
            from robolink.transport import parse_url
            from robolink.transport.opcua.security import protection_remark

            self._told.add(cell.url)
            if remark := protection_remark(parse_url(cell.url)):
                self._tell(f"{cell.name}: {remark}")

    def exchanges(self, order: str) -> int:
        """Return how many requests a job has sent; see :class:`robolink.fleet.silence.CellLine`."""
        line = self._lines.get(order)
        return 0 if line is None or line.controller is None else line.controller.exchanges

    def cut_off(self, order: str, ended: Callable[[JobOutcome | None], None]) -> None:
        """Cut a job off from its cell; see :class:`robolink.fleet.silence.CellLine`."""
        line = self._lines.get(order)
        if line is None:
            ended(None)
        else:
            line.cut_off(ended)

    def _cell(self, name: str) -> "tuple[Cell, int]":
        """Return a cell as the files say now, and for how many days checks are kept.

        Raises:
            ConfigError: There is no such cell, or a cell file is wrong.
        """
        files = self._cell_files()
        if name not in files.cells:
            raise ConfigError(
                tr("This computer has no cell {name}.", name=name),
                remedy=known_names(tuple(files.cells), name),
            )
        return files.cells[name], files.keep_checks_days

    def cells(self) -> "Mapping[str, Cell]":
        """Return the cells of this computer as the files say now.

        Raises:
            ConfigError: A cell file is wrong.
        """
        return self._cell_files().cells

    def _cell_files(self) -> "CellFiles":
        from robolink.config import config_files, load_cell_files, use_journals_of

        with self._reading:  # once, however many jobs begin together
            now = tuple(_state_of(file.path) for file in config_files())
            if self._files is None or now != self._as_of:
                self._files, self._as_of = load_cell_files(), now
                use_journals_of(self._files.cells.values(), self._files.journal)
            return self._files

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
    from robolink.transaction import carrying_out, order_on_record

    said = dict(job.plan.offsets[job.cell.name])
    ordered = {"command": "fleet", **said, "tool": int(said["tool"])}
    done, kept = JobOutcome(DONE, what="Written and read back."), False
    try:
        with (
            job.connected() as controller,
            carrying_out(controller, job.order, ordered, ends=ends_order) as order,
            job.not_cut_off(),
        ):
            if order.done is not None:
                done, kept = replace(done, what="Written before.", change=order.done.change), True
            else:
                try:
                    _write(job, controller, order, said)
                finally:
                    with suppress(RobolinkError):  # else it counts as what ended it
                        kept = order_on_record(controller.outcomes, order.id, order.job) is not None
    except Exception as error:  # a stop, say, while the controller is closed
        return kept_before(done if kept else None, error)
    return done


def _write(job: _Job, controller: "Controller", order: "Order", said: dict[str, float]) -> None:
    """Write an offset; see :func:`_write_offset`."""
    from robolink.backup import keep_first_backup
    from robolink.model import ToolOffset
    from robolink.transaction import Wanted, change_tools

    if job.permit is None:
        raise BusyError(
            tr("Nothing was written: the plan may not begin anything now."),
            remedy=tr("It is tried again when the plan may go on."),
        )
    tool = int(said.pop("tool"))
    controller.tools.require_writable(tool)
    before = controller.tools.read(tool)
    now = ToolOffset() if before is None or before.of_no_tool else before
    keep_first_backup(controller, tell=lambda _sentence: None)
    change_tools(controller, [Wanted(tool, replace(now, **said), before)], order=order)


def _was_cut_off() -> JournalError:
    return JournalError(
        tr("The job had given no sign of life, and was cut off from its cell."),
        remedy=tr("Look at this computer's disks, then resume the plan."),
    )


def _listener(tell: Callable[[str], None]) -> "SharedStopListener | None":
    """Return what hears stops from other terminals; ``None`` where that cannot be."""
    from robolink.journal import this_process
    from robolink.stopping import SharedStopListener

    who = tr("{who} (plans of many cells)", who=this_process().os_user or "?")
    return SharedStopListener.telling(tell, who=who)


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
