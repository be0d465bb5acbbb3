"""What is noted at a plant beside its plans: how its cells stand, and what happened, in order.

A :class:`PlantNotes` has a connection of its own, so that whoever looks at a plant keeps no agent
from its work.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Final

from robolink.fleet.plans import Plan
from robolink.fleet.plant_view.cell_states import CellState
from robolink.fleet.progress import Halt
from robolink.fleet.states import JobState
from robolink.fleet.store import statements
from robolink.fleet.store.course import PlanCourse
from robolink.fleet.store.database import FleetDatabase
from robolink.fleet.store.rows import label_of, read_halt, read_plan
from robolink.interrupts import ClosedAtExit
from robolink.journal.store.chain import canonical
from robolink.journal.store.connection import DatabaseConnection
from robolink.timing import wall_time

_ANYTHING: Final[Mapping[str, tuple[str, int] | None]] = {}

NEVER: Final = "9"
"""A label after all others."""


@dataclass(frozen=True, slots=True)
class PlanSummary:
    """A plan in numbers.

    Attributes:
        id: Its id.
        kind: What its cells do.
        name: What people call it.
        made_at: When it was made, as a label.
        recipe_hash: SHA-256 of its recipe; empty where it has none.
        cancelled_at: When it was cancelled; empty where it was not.
        counts: How many jobs are in each state.
        halts: Why it stands and stood, oldest first.
    """

    id: str
    kind: str
    name: str
    made_at: str
    recipe_hash: str
    cancelled_at: str
    counts: Mapping[JobState, int] = field(hash=False)
    halts: tuple[Halt, ...] = ()

    @property
    def finished(self) -> bool:
        """Whether nothing more comes of it."""
        return all(state.final for state in self.counts)

    @property
    def left_count(self) -> int:
        """How many jobs did not do what was asked, and were not cancelled."""
        left = (JobState.REFUSED, JobState.UNSETTLED, JobState.MISSED)
        return sum(self.counts.get(state, 0) for state in left)

    @property
    def standing(self) -> tuple[Halt, ...]:
        """The halts that keep it from going on."""
        return tuple(halt for halt in self.halts if halt.stands and not self.cancelled_at)


@dataclass(frozen=True, slots=True)
class PlantLook:
    """What was on record of a plant at one instant.

    Attributes:
        cells: How each cell stood, by name.
        plans: The plans, newest first.
        behind_count: How many entries of its journals it has no copy of; ``None`` where it takes
            no copies.
        unnoted: Cells of its plans of which no home ever noted how they stand.
    """

    cells: Mapping[str, CellState] = field(hash=False)
    plans: tuple[PlanSummary, ...]
    behind_count: int | None = None
    unnoted: tuple[str, ...] = ()


class PlantNotes(ClosedAtExit):
    """Reads and adds notes in a plant's database.

    Args:
        location: Path of a file, or URL of a PostgreSQL database.
        plant: Id of the plant.
        clock: Returns the time, with its zone: for labels.

    Raises:
        PlantError: The location is none; and by each method, the database cannot be used.

    Example:
        >>> from robolink.fleet import PlantNotes
        >>> with PlantNotes("plant-notes-example.db", "plant") as notes:
        ...     look = notes.look()
        >>> look.cells, look.plans
        ({}, ())
    """

    def __init__(
        self, location: str, plant: str, *, clock: Callable[[], datetime] = wall_time
    ) -> None:
        self._database = FleetDatabase(location)
        self._plant, self._clock = plant, clock

    @property
    def name(self) -> str:
        """Where it is, as a person is told: no password."""
        return self._database.name

    @property
    def made(self) -> bool:
        """Whether it may hold anything: files are looked for, servers are not."""
        return self._database.made

    def close(self) -> None:
        """Close the connection; the next call makes a new one."""
        self._database.close()

    # ---- Cells

    def cells(self) -> dict[str, CellState]:
        """Return how each cell stands that was noted, by name."""
        with self._database.transaction() as database:
            rows = database.rows(statements.CELL_STATES, {"plant": self._plant})
        return {cell: CellState.from_row(at, document) for cell, at, document in rows}

    def counted(
        self, position: str, cells: Iterable[str], *, unless: tuple[str, int] | None
    ) -> tuple[tuple[str, int] | None, dict[str, CellState] | None]:
        """Return a position, and how the cells stand that count up to it, as of one instant.

        Args:
            position: Its name.
            cells: Their names; one that was not noted is left out.
            unless: The position at which nothing is asked about cells.

        Returns:
            Both; ``None`` for cells that were not asked about.

        Example:
            >>> from robolink.fleet import CellState, PlantNotes
            >>> with PlantNotes("counted-example.db", "plant") as notes:
            ...     _ = notes.note({"a": CellState("epson-1", "home")}, {"journal": ("1f", 7)})
            ...     at, cells = notes.counted("journal", ["a", "b"], unless=None)
            >>> at, list(cells)
            (('1f', 7), ['a'])
        """
        with self._database.transaction() as database:
            found = self._position(database, position)
            if found == unless:
                return found, None
            states = {}
            for cell in cells:
                where = {"plant": self._plant, "cell": cell}
                for at, document in database.rows(statements.CELL_STATE, where):
                    states[cell] = CellState.from_row(at, document)
        return found, states

    def note(
        self,
        states: Mapping[str, CellState],
        positions: Mapping[str, tuple[str, int]],
        *,
        after: Mapping[str, tuple[str, int] | None] = _ANYTHING,
    ) -> bool:
        """Note how cells stand now, and up to which entry of which journal that counts.

        Args:
            states: By name of the cell.
            positions: Chain and number of the last entry that was looked at, by journal.
            after: The positions from which the states follow, by journal.

        Returns:
            Whether they were noted: nothing is, once another process has moved such a position.

        Example:
            >>> from robolink.fleet import CellState, PlantNotes
            >>> states, first, then = {"a": CellState("epson-1", "home")}, ("1f", 7), ("1f", 8)
            >>> with PlantNotes("note-example.db", "plant") as notes:
            ...     _ = notes.note(states, {"journal": first})
            ...     ok = notes.note(states, {"journal": then}, after={"journal": first})
            ...     late = notes.note(states, {"journal": then}, after={"journal": first})
            >>> ok, late
            (True, False)
        """
        at = label_of(self._clock())
        rows = [
            {"plant": self._plant, "cell": cell, "at": at, "document": canonical(state.document())}
            for cell, state in states.items()
        ]
        with self._database.transaction() as database:
            lock = database.row_lock
            if any(self._position(database, name, lock) != it for name, it in after.items()):
                return False
            if rows:
                database.run_many(statements.NOTE_CELL, rows)
            for name, (chain, number) in positions.items():
                values = {"name": self._own(name), "chain": chain, "number": number}
                database.run(statements.SET_POSITION, values)
        return True

    def position(self, name: str) -> tuple[str, int] | None:
        """Return a position that was noted under a name; ``None`` for none."""
        with self._database.transaction() as database:
            return self._position(database, name)

    def _position(
        self, database: DatabaseConnection, name: str, lock: str = ""
    ) -> tuple[str, int] | None:
        rows = database.rows(statements.POSITION + lock, {"name": self._own(name)})
        return (str(rows[0][0]), int(rows[0][1])) if rows else None

    def _own(self, name: str) -> str:
        return f"{self._plant} {name}"

    # ---- Values that were written without motion

    def unproved(self) -> tuple[tuple[str, str], ...]:
        """Return plan and cell of each job that waits for a turn test, oldest plan first."""
        with self._database.transaction() as database:
            rows = database.rows(statements.UNPROVED, {"plant": self._plant})
        return tuple((str(plan), str(cell)) for plan, cell in rows)

    def prove(self, proofs: Iterable[tuple[str, str, int]]) -> None:
        """Record later turn tests: plan, cell, and the number of the test's entry."""
        for plan, cell, entry in proofs:
            with self._database.transaction() as database:
                rows = database.rows(statements.PLAN + database.row_lock, {"plan": plan})
                document, cancelled_at, bound_to = rows[0]
                found, now = read_plan(document), self._clock()
                course = PlanCourse(database, found, now, bool(cancelled_at), bound_to)
                course.prove(cell, entry)

    # ---- All of it

    def look(self, *, most: int = 20, since: str = NEVER) -> PlantLook:
        """Return what is on record now, as of one instant.

        Args:
            most: How many of the newest plans; those that are not finished are there in any case.
            since: Those made at this label or later are, too.
        """
        with self._database.transaction() as database:
            where = {"plant": self._plant, "most": most, "since": since}
            cells = database.rows(statements.CELL_STATES, {"plant": self._plant})
            plans = [
                _summary(database, read_plan(document), cancelled_at)
                for document, cancelled_at in database.rows(statements.RECENT_PLANS, where)
            ]
            behind = self._behind(database)
            unnoted = database.rows(statements.UNNOTED_CELLS, {"plant": self._plant})
        states = {cell: CellState.from_row(at, document) for cell, at, document in cells}
        return PlantLook(states, tuple(plans), behind, tuple(str(cell) for (cell,) in unnoted))

    def _behind(self, database: DatabaseConnection) -> int | None:
        if not database.has_schemas or database.rows(statements.TAKES_COPIES) == [(None,)]:
            return None
        journals = f"{self._own('journal')} %"
        ((count,),) = database.rows(statements.BEHIND, {"journals": journals})
        return int(count)

    # ---- What happened

    def last_event(self) -> int:
        """Return the number of the newest event, 0 for none."""
        with self._database.transaction() as database:
            return int(database.rows(statements.LAST_EVENT)[0][0])

    def events(self, after: int, most: int = 100) -> tuple[tuple[int, dict[str, object]], ...]:
        """Return what happened after an event, in order: outcomes, halts, and what lifted them.

        Args:
            after: Number of that event.
            most: How many at most.

        Example:
            >>> from robolink.fleet import FleetStore, PlantNotes, plan_of
            >>> table = {"schema": "robolink/fleet-plan/1", "kind": "check", "name": "n"}
            >>> plan = plan_of({**table, "cells": ["a"]}, cells=["a"])
            >>> with FleetStore("events.db") as store:
            ...     store.add_plan(plan)
            ...     _ = store.halt(plan.id, "Li", "the line stands")
            >>> with PlantNotes("events.db", "plant") as notes:
            ...     [(number, event["event"]) for number, event in notes.events(0, 10)]
            [(1, 'halt')]
        """
        values = {"plant": self._plant, "after": after, "most": most}
        with self._database.transaction() as database:
            rows = database.rows(statements.EVENTS, values)
        return tuple((int(number), json.loads(document)) for number, document in rows)


def _summary(database: DatabaseConnection, plan: Plan, cancelled_at: str) -> PlanSummary:
    rows = database.rows(statements.STATES, {"plan": plan.id})
    halts = database.rows(statements.HALTS, {"plan": plan.id})
    return PlanSummary(
        plan.id,
        str(plan.kind),
        plan.name,
        plan.made_at,
        plan.recipe_hash,
        cancelled_at,
        {JobState(state): int(count) for state, count in rows},
        tuple(map(read_halt, halts)),
    )
