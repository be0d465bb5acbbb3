"""Checks of cells, one or many at once: connect, compare with the record, log out.

Nothing moves, nothing is written to a controller, and no lease is taken. A cell at which somebody
works is left alone: an EPSON controller serves one client, so the record and the processes of this
computer are asked first. Each cell has one deadline for everything. Many are worked at at the same
time, and those that do not connect hold no other up: cells that are off cost the others nothing.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from queue import Empty, SimpleQueue
from threading import Event, Lock
from typing import Final

from robolink.backup import ToolState, read_tools
from robolink.config import Cell, connect_cell
from robolink.controllers import connect as connect_url
from robolink.errors import (
    BusyError,
    LoginUnansweredError,
    NotReadyError,
    RobolinkError,
    TransportTimeoutError,
)
from robolink.inspection._certificates import certificate_findings
from robolink.inspection._check_record import (
    CheckPlace,
    EndedCheck,
    Met,
    Recorder,
    met_by,
    place_of,
)
from robolink.inspection._check_results import CellCheck, CheckFailure
from robolink.inspection._inspection import Inspection, inspect
from robolink.journal import (
    Meetings,
    name_journals,
    open_journal,
    require_home,
    signature_here,
)
from robolink.messages import tr
from robolink.model import Controller, Signature
from robolink.stopping import SharedStopListener, holders_of
from robolink.timing import NS_PER_S, Clock, Deadline, SystemClock
from robolink.transport import far_end_of, parse_url, serves_several
from robolink.transport.tcp import aside_while_dialling
from robolink.version import VERSION

AT_ONCE: Final = 64
"""Number of cells that are worked at at the same time; those whose connection is long in coming are
not counted."""

_ASIDE: Final = 7
"""So many times as many are waited for until they can be connected to: with those that are worked
at, half of the 1,024 files that Linux gives a process. Where it gives fewer, fewer are."""

_LONG_S: Final = 0.1
"""From so long on a connection is waited for, in s; a controller that is on takes 1 ms."""

DEADLINE_S: Final = 10.0
"""Longest time for one cell, in s; connecting to one that is off ends after its time-out."""

_TICK_S: Final = 0.25


Connect = Callable[[Cell | str], Controller]


def check_cell(
    cell: Cell | str,
    *,
    since: str = "",
    tools: Callable[[Controller], ToolState] = read_tools,
    connect: Connect | None = None,
    signature: Signature | None = None,
    keep_days: int | None = None,
) -> CellCheck:
    """Check one cell, and record that; see :func:`check_cells`.

    Args:
        cell: The cell, its name, or the URL of a controller.
        since: Changes with an earlier label (ISO 8601) are left out of the charts.
        tools: How the tools are read.
        connect: How the cell is connected to; by default as its file says.
        signature: Who checks; by default the user of this computer.
        keep_days: For how many days checks are kept, as ``load_cell_files().keep_checks_days``
            says; by default none is deleted.

    Raises:
        ConfigError: There is no such cell, or a cell file is wrong.

    Example:
        >>> from robolink.inspection import check_cell
        >>> found = check_cell("epson+sim://check-cell-example")
        >>> found.state, found.failure
        (<CheckState.WELL: 'well'>, None)
    """
    (found,) = check_cells(
        [cell],
        since=since,
        tools=tools,
        connect=connect,
        signature=signature,
        keep_days=keep_days,
    )
    return found


def check_cells(
    cells: Iterable[Cell | str],
    *,
    since: str = "",
    tools: Callable[[Controller], ToolState] = read_tools,
    connect: Connect | None = None,
    signature: Signature | None = None,
    keep_days: int | None = None,
    at_once: int = AT_ONCE,
    deadline_s: float = DEADLINE_S,
    progress: Callable[[CellCheck], None] = lambda _check: None,
    tell: Callable[[str], None] = lambda _sentence: None,
) -> tuple[CellCheck, ...]:
    """Check cells, many at once, and record each check outside the chain of the journal.

    What keeps one cell from being checked is in its result, and ends nothing else; that its home is
    another computer, too: the record that it is compared with is there. Ctrl-C lets
    the checks under way log out; those that were finished are on record.

    Args:
        cells: The cells, their names, or URLs of controllers.
        since: Changes with an earlier label (ISO 8601) are left out of the charts.
        tools: How the tools are read; while production runs, an EPSON controller tells only
            those that its project publishes.
        connect: How a cell is connected to; by default as its file says, and a URL as it is.
        signature: Who checks; by default the user of this computer.
        keep_days: For how many days checks are kept, as ``load_cell_files().keep_checks_days``
            says; by default none is deleted.
        at_once: How many cells are worked at at the same time. One that does not connect at once
            is not counted, so that cells that are off cost the others nothing.
        deadline_s: Longest time for one cell.
        progress: Called in this thread with each check that has ended.
        tell: Receives sentences about a cell that a person should know once.

    Returns:
        The checks in the order of the cells.

    Raises:
        ConfigError: There is no such cell, or a cell file is wrong.

    Example:
        >>> from robolink.inspection import check_cells
        >>> checks = check_cells([f"epson+sim://check-{n}-example" for n in range(3)])
        >>> [check.state.value for check in checks]
        ['well', 'well', 'well']
    """
    places = [place_of(number, cell) for number, cell in enumerate(cells)]
    of = {place.address: place.cell for place in places if isinstance(place.cell, Cell)}
    name_journals(
        {address: cell.settings.journal or "" for address, cell in of.items()},
        homes={address: cell.home for address, cell in of.items()},
    )
    with ExitStack() as stack:
        listener = _listener(places, tell)
        if listener is not None:
            stack.enter_context(listener)
        recorder = Recorder(places, signature or signature_here(VERSION), keep_days, tell)
        looker = _Looker(
            since, tools, connect or _connected, listener, recorder.meetings, deadline_s, tell
        )
        together = min(at_once, len(places))
        ended = _together(looker, places, together) if together > 1 else map(looker.check, places)
        try:
            for check in ended:
                progress(recorder.take(check))
        finally:
            recorder.store()
    return recorder.checks


def _connected(cell: Cell | str) -> Controller:
    return connect_url(cell) if isinstance(cell, str) else connect_cell(cell)


def _listener(
    places: Sequence[CheckPlace], tell: Callable[[str], None]
) -> SharedStopListener | None:
    """Return what hears a stop from another terminal; ``None`` where it cannot, or need not."""
    if not any(not place.inside for place in places):
        return None
    who = tr("{who} (a check of cells)", who=signature_here(VERSION).os_user or "?")
    return SharedStopListener.telling(tell, who=who)


class _Looker:
    """Checks one cell after the other, in any number of threads."""

    def __init__(
        self,
        since: str,
        tools: Callable[[Controller], ToolState],
        connect: Connect,
        listener: SharedStopListener | None,
        meetings: Meetings,
        deadline_s: float,
        tell: Callable[[str], None],
    ) -> None:
        self._since, self._tools, self._connect = since, tools, connect
        self._listener, self._meetings, self._tell = listener, meetings, tell
        self.deadline_s = deadline_s
        self.ending = Event()

    def check(self, place: CheckPlace) -> EndedCheck:
        """Check a cell; whatever keeps it from that is in the result."""
        clock = SystemClock()
        begun_ns, deadline = clock.now_ns(), Deadline.after(clock, self.deadline_s)
        found: list[Inspection] = []
        met: list[Met] = []
        failure = None
        try:
            with self._meetings.gathered(place.called):
                self._look(place, deadline, found, met)
        except RobolinkError as error:
            failure = CheckFailure.of(error)
        seconds = (clock.now_ns() - begun_ns) / NS_PER_S
        check = CellCheck(place.called, found[0] if found else None, failure, seconds)
        return EndedCheck(place, check, met[0] if met else None)

    def _look(
        self, place: CheckPlace, deadline: Deadline, found: list[Inspection], met: list[Met]
    ) -> None:
        self._require_time(deadline)
        require_home(place.address)  # elsewhere there is no record to compare the tools with
        if not place.inside:
            _require_nobody(place)
        try:
            controller = self._connect(place.cell)
        except LoginUnansweredError:
            _require_nobody(place)  # whoever came in between is named
            raise
        with controller, controller.latch.ending(tr("The check")):
            outcomes = controller.outcomes
            if outcomes.trouble is not None:
                raise outcomes.trouble
            met.append(met_by(controller))
            # By now it is known who the controller is, and somebody may have begun meanwhile.
            if at_work := outcomes.at_work():
                raise _busy(at_work)
            for remark in outcomes.remarks:
                self._tell(f"{place.called}: {remark}")
            with self._heard(controller, place, outcomes.identity):
                self._require_time(deadline)
                tools: ToolState | NotReadyError
                try:
                    tools = self._tools(controller)
                except NotReadyError as error:
                    tools = error
                self._require_time(deadline)
                cell = None if isinstance(place.cell, str) else place.cell
                inspected = inspect(controller, tools, cell=cell, since=self._since)
                if "+opcua://" in place.url:
                    within_s = deadline.remaining_s()
                    ends = certificate_findings(parse_url(place.url), timeout_s=within_s)
                    inspected = inspected.with_findings(ends)
                found.append(inspected)
        controller.latch.require_open(tr("The check"))  # a stop came while it was closing

    def _heard(
        self, controller: Controller, place: CheckPlace, name: str
    ) -> AbstractContextManager[None]:
        """Let a stop from another terminal reach the controller while this process has it."""
        if self._listener is None or place.inside:
            return nullcontext()
        return self._listener.listening(controller, place.url, name=name)

    def _require_time(self, deadline: Deadline) -> None:
        if deadline.expired or self.ending.is_set():
            raise _too_late(self.deadline_s)


def _too_late(deadline_s: float) -> TransportTimeoutError:
    return TransportTimeoutError(
        tr("The check took longer than {seconds:g} s.", seconds=deadline_s),
        remedy=tr("Look at the network and at the controller, then check it again."),
    )


def _require_nobody(place: CheckPlace) -> None:
    """Leave a cell alone at which somebody works.

    Raises:
        BusyError: Somebody does; the sentence says who.
        JournalError: The record cannot be read.
    """
    if not serves_several(place.url):
        for holder in holders_of(far_end_of(place.url), others=True):
            raise _busy(
                tr(
                    "{who} is working on it.",
                    who=holder.who or tr("process {pid}", pid=holder.pid),
                )
            )
    at_work = open_journal(address=place.address).log(place.address).at_work()
    if at_work:
        raise _busy(at_work)


def _busy(who: str) -> BusyError:
    return BusyError(who, remedy=tr("Nothing was sent. Check the cell again later."))


class CheckSlots:
    """How many cells are worked at; one that waits long for its connection holds no slot.

    Args:
        most: How many may be worked at at the same time.
        aside: How many more may be waited for.
        clock: The clock.
    """

    def __init__(self, most: int, aside: int, clock: Clock) -> None:
        self._most, self._aside, self._clock = most, aside, clock
        self._lock = Lock()
        self._taken = 0
        self._dialled: dict[object, Deadline] = {}

    def take(self) -> bool:
        """Take a slot for a cell; false where none is free, or too many cells are waited for."""
        with self._lock:
            aside = sum(one.expired for one in self._dialled.values())
            free = self._taken < self._most + min(aside, self._aside)
            self._taken += free
            return free

    def leave(self) -> None:
        """Give a slot back."""
        with self._lock:
            self._taken -= 1

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Hold no slot in the block from :data:`_LONG_S` on; behind it there is one too many.

        It is let in all the same: whoever is connected to an EPSON controller keeps others out.
        """
        key = object()
        with self._lock:
            self._dialled[key] = Deadline.after(self._clock, _LONG_S)
        try:
            yield
        finally:
            with self._lock:
                del self._dialled[key]


def most_aside(most: int) -> int:
    """Return how many cells may be waited for beside those that are worked at.

    Each has an open file, and of those that this process may have a half is left to all else.

    Args:
        most: How many may be worked at at the same time.
    """
    try:
        import resource  # not on Windows, where sockets are no files
    except ImportError:
        return most * _ASIDE
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if files == resource.RLIM_INFINITY:
        return most * _ASIDE
    return max(0, min(most * _ASIDE, files // 2 - most))


def _together(looker: _Looker, places: Sequence[CheckPlace], together: int) -> Iterator[EndedCheck]:
    """Yield checks as they end, so many at once; whoever leaves early waits for those under way.

    A check that does not end in its time counts as ended: its exchanges have deadlines of their
    own, and its thread ends with them.
    """
    ended: SimpleQueue[tuple[int, EndedCheck | BaseException]] = SimpleQueue()
    begun: dict[int, Deadline] = {}
    longest_s = looker.deadline_s + 2 * _TICK_S
    aside = most_aside(together)
    slots = CheckSlots(together, aside, SystemClock())

    def work(number: int) -> None:
        begun[number] = Deadline.after(SystemClock(), longest_s)
        found: EndedCheck | BaseException
        try:
            with aside_while_dialling(slots.aside):
                found = looker.check(places[number])
        except BaseException as error:
            found = error
        slots.leave()
        ended.put((number, found))

    pool = ThreadPoolExecutor(together + aside, thread_name_prefix="robolink-check")
    left, waiting = set(range(len(places))), iter(range(len(places)))
    following = next(waiting, None)
    try:
        while left:
            while following is not None and slots.take():
                pool.submit(work, following)
                following = next(waiting, None)
            try:
                number, found = ended.get(timeout=_TICK_S if following is None else _LONG_S)
            except Empty:
                late = [one for one in left if one in begun and begun[one].expired]
                for one in late:
                    left.discard(one)
                    place = places[one]
                    failure = CheckFailure.of(_too_late(looker.deadline_s))
                    yield EndedCheck(place, CellCheck(place.called, None, failure, longest_s))
                continue
            if number in left:
                left.discard(number)
                if isinstance(found, BaseException):
                    raise found
                yield found
    finally:
        looker.ending.set()
        pool.shutdown(cancel_futures=True)
