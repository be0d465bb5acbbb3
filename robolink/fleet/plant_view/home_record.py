"""Notes at the plant how the cells of this computer stand, from their journals.

This computer is the home of its cells: their journals are here, and are the record. What is noted
follows from them alone, each entry counts once, and a journal that did not change is not read.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import islice
from typing import Final

from robolink import runtime
from robolink.config import Cell
from robolink.errors import RobolinkError
from robolink.fleet.errors import PlantError
from robolink.fleet.plant_view.cell_states import READ, CellState
from robolink.fleet.plant_view.later_proofs import KINDS, proof_of
from robolink.fleet.plant_view.notes import PlantNotes
from robolink.fleet.store.rows import label_of
from robolink.journal import Journal, default_location, may_exist, open_journal
from robolink.journal._outbox import home_of
from robolink.journal._places import place_of
from robolink.model import EntryKind
from robolink.plug_ins import unexpected
from robolink.timing import wall_time
from robolink.transport import parse_url

EVERY_S: Final = 10.0
"""Pause between two looks at the journals, s."""

FRESH_S: Final = 600.0
"""How often a state that did not change is noted again, so that its age shows that its home
works, s."""

_KINDS: Final = (*READ, EntryKind.VERIFY)

Key = tuple[object, ...]


@dataclass
class _Known:
    """What is known of one journal.

    Attributes:
        cells: The addresses of its cells, by name.
        stamp: State of its file when it was read.
        last: Number of its last entry then.
        check: Number of the last check.
        owners: The cell that each name in it stands for.
        counted: Chain and number of the last entry that counts, as this process noted it.
    """

    cells: Mapping[str, str]
    stamp: Key = ()
    last: int = 0
    check: int = 0
    owners: dict[str, str] = field(default_factory=dict)
    counted: tuple[str, int] | None = None


class HomeRecord:
    """Keeps what is noted of this computer's cells up to date; not thread-safe.

    Args:
        location: The plant's database: path of a file, or URL of PostgreSQL.
        plant: Id of the plant.
        cells: Returns the cells of this computer as its files say now.
        tell: Receives sentences for people, each trouble once.
        clock: Returns the time, with its zone.
    """

    def __init__(
        self,
        location: str,
        plant: str,
        cells: Callable[[], Mapping[str, Cell]],
        *,
        tell: Callable[[str], None] = lambda _sentence: None,
        clock: Callable[[], datetime] = wall_time,
    ) -> None:
        self._notes = PlantNotes(location, plant, clock=clock)
        self._cells, self._tell, self._clock = cells, tell, clock
        self._states: dict[str, CellState] = {}
        self._journals: dict[str, _Known] = {}
        self._orders: dict[tuple[str, str], int] = {}
        self._unlooked: set[str] = set()
        self._looked: set[tuple[str, str]] = set()
        self._trouble = ""

    def close(self) -> None:
        """Close the connection to the plant's database."""
        self._notes.close()

    @contextmanager
    def noted_meanwhile(self, every_s: float = EVERY_S) -> Iterator[None]:
        """Note now and then while the block runs, and once at its end."""
        end = runtime.regularly(every_s, self.try_to_note, "states of cells")
        try:
            yield
        finally:
            end()
            self.try_to_note()
            self.close()

    def try_to_note(self) -> None:
        """Note, and tell once what keeps it from that; the next look makes up for it."""
        trouble = ""
        try:
            self.note()
        except RobolinkError as error:
            trouble = str(error)
        except Exception as error:  # a defect is told, too, and ends no later look
            trouble = unexpected(error)
        if trouble and trouble != self._trouble:
            self._tell(trouble)
        self._trouble = trouble

    def note(self) -> None:
        """Read what was recorded since the last look, and note what follows from it.

        Raises:
            PlantError: The plant's database cannot be used; nothing was noted.
            JournalError: A journal cannot be read; the others were noted.
            ConfigError: A cell file is wrong.
        """
        journals = self._present()
        unproved: dict[str, list[str]] = {}
        for plan, cell in self._notes.unproved():
            unproved.setdefault(cell, []).append(plan)
        trouble: Exception | None = None
        for location, known in journals.items():
            try:
                self._note_journal(location, known, unproved)
            except PlantError:
                raise  # it would be the same for each
            except Exception as error:  # a journal that is broken keeps no other from being noted
                trouble = trouble or error
        if trouble is not None:
            raise trouble

    def _present(self) -> dict[str, _Known]:
        """Return the journals of the cells; what is known of one whose cells changed is dropped."""
        cells: dict[str, dict[str, str]] = {}
        for name, cell in self._cells().items():
            # Of a simulator in a process the journal ends with it; and of a cell whose home is
            # another computer that one notes how it stands.
            if cell.home.is_here and "+sim://" not in cell.url:
                address = parse_url(cell.url).address
                cells.setdefault(default_location(address), {})[name] = address
        for location, here in cells.items():
            if location not in self._journals or self._journals[location].cells != here:
                self._journals[location] = _Known(here)
                self._unlooked |= here.keys()
        return {location: self._journals[location] for location in cells if may_exist(location)}

    def _note_journal(
        self, location: str, known: _Known, unproved: Mapping[str, list[str]]
    ) -> None:
        stamp = _stamp_of(location)
        due = [name for name in known.cells if self._is_due(name)]
        wanted = [
            (plan, name)
            for name in known.cells
            for plan in unproved.get(name, ())
            if name in self._unlooked or (plan, name) not in self._looked
        ]
        if stamp == known.stamp and stamp and not due and not wanted:
            return
        journal = open_journal(location, read_only=True)
        try:
            states, before, position = self._read(journal, known)
            changed = {
                name: state
                for name, state in states.items()
                if self._is_due(name) or state != self._of(name)
            }
            if not self._notes.note(changed, position, after=before):
                known.counted = None  # another process notes, too: what follows from its notes
                return  # is noted at the next look
            known.counted = next(iter((position or before).values()))
            at = label_of(self._clock())
            self._states |= {name: replace(one, noted_at=at) for name, one in changed.items()}
            wanted += [
                (plan, name)
                for name in self._unlooked & known.cells.keys()
                for plan in unproved.get(name, ())
            ]
            self._notes.prove(
                (plan, name, proof)
                for plan, name in dict.fromkeys(wanted)
                if (proof := self._proof(journal, states[name].controller, f"{plan}/{name}"))
            )
            self._looked.update(wanted)
            self._unlooked -= known.cells.keys()
            known.stamp = stamp
        finally:
            journal.close()  # a plant has thousands: none stays open

    def _read(
        self, journal: Journal, known: _Known
    ) -> tuple[dict[str, CellState], dict[str, tuple[str, int] | None], dict[str, tuple[str, int]]]:
        """Return the states of a journal's cells, and after and up to which entry that counts."""
        home = home_of(journal.location)
        position_name = f"journal {home}"
        last = next(journal.entries(limit=1), None)
        first = None if last is None else journal.entry(1)
        chain, number = (first.hash if first else ""), (last.number if last else 0)
        if number != known.last or not known.owners:
            names = {name: journal.names_of(address) for name, address in known.cells.items()}
            known.owners = {one: name for name, of_it in names.items() for one in of_it}
            known.last = number
        identity = {name: one for one, name in reversed(known.owners.items())}
        before = self._position(position_name, known)
        begun = before[1] if before and before[0] == chain else 0
        states = {}
        for name in known.cells:
            state, controller = self._of(name), identity.get(name, "")
            if begun and (state.controller, state.journal) == (controller, home):
                states[name] = state
                continue
            states[name] = CellState(controller, home)
            if begun:  # it came to this journal after the others
                told = journal.entries(
                    controller=controller, kinds=_KINDS, before=begun + 1, newest_first=False
                )
                states[name] = states[name].after(told)
        self._add_entries(journal, known, states, begun, number)
        self._add_checks(journal, known, states)
        self._add_markers(journal, known, states)
        position = {position_name: (chain, number)} if chain else {}
        return states, {position_name: before}, position

    def _position(self, name: str, known: _Known) -> tuple[str, int] | None:
        """Return up to where a journal counts; take the states from there if another noted it."""
        position, states = self._notes.counted(name, known.cells, unless=known.counted)
        if states is not None:
            for cell in known.cells:
                self._states.pop(cell, None)
            self._states |= states
            known.check = 0
        return position

    def _add_entries(
        self, journal: Journal, known: _Known, states: dict[str, CellState], begun: int, end: int
    ) -> None:
        entries = journal.entries(kinds=_KINDS, after=begun, before=end + 1, newest_first=False)
        for entry in entries:
            name = known.owners.get(entry.controller)
            if name is None:
                continue
            if entry.kind is EntryKind.VERIFY:
                self._unlooked.add(name)
            else:
                states[name] = states[name].after([entry])

    def _add_checks(self, journal: Journal, known: _Known, states: dict[str, CellState]) -> None:
        found = set[str]()
        newest = 0
        for check in islice(journal.checks(), 10 * len(known.cells) + 100):
            newest = newest or check.number
            if check.number <= known.check or len(found) == len(known.cells):
                break
            name = check.cell if check.cell in states else known.owners.get(check.controller, "")
            if name and name not in found:
                found.add(name)
                states[name] = states[name].checked(check)
        known.check = max(known.check, newest)

    def _add_markers(self, journal: Journal, known: _Known, states: dict[str, CellState]) -> None:
        since: dict[str, str] = {}
        for controller, marker in journal.open_markers():
            # A marker is of the whole controller, and each of its robots has a record.
            for name in (controller, *journal.robots_of(controller)):
                if cell := known.owners.get(name):
                    since[cell] = min(marker.begun_at, since.get(cell, marker.begun_at))
        for name in states:
            states[name] = replace(states[name], unsettled_since=since.get(name, ""))

    def _proof(self, journal: Journal, controller: str, order: str) -> int | None:
        """Return the later turn test that confirms what an order wrote; ``None`` for none."""
        key = (journal.location, order)
        if key not in self._orders:
            orders = journal.entries(controller=controller, kinds=(EntryKind.ORDER,))
            found = next((one for one in orders if one.details.get("order") == order), None)
            if found is None:
                return None
            self._orders[key] = found.number
        after = self._orders[key] - 1
        entries = journal.entries(
            controller=controller, kinds=KINDS, after=after, newest_first=False
        )
        return proof_of(entries, order)

    def _of(self, name: str) -> CellState:
        return self._states.get(name, CellState())

    def _is_due(self, name: str) -> bool:
        at = self._of(name).noted_at
        if not at:
            return True
        age_s = (self._clock() - datetime.fromisoformat(at)).total_seconds()
        return not 0 <= age_s < FRESH_S  # a clock that was set back must not prolong it


def _stamp_of(location: str) -> Key:
    """Return what changes with a journal's file; nothing for a server."""
    path = place_of(location).path
    if path is None:
        return ()
    found = list[object]()
    for file in (path, path.with_name(path.name + "-wal")):
        try:
            stat = file.stat()
        except OSError:
            found.append(None)
        else:
            found.append((stat.st_ino, stat.st_mtime_ns, stat.st_size))
    return tuple(found)
