"""The seal of a record that was moved: nobody writes it any more where it was.

A process may have had the journal open for days, and an earlier robolink knows of no seal. So the
database itself refuses, in the transaction that writes: a trigger on each table looks for the name
of the row's controller in ``moved_records``. A journal that was never moved has neither the table
nor the triggers, and pays nothing.

A journal that was moved as a whole also gets a version that no robolink has. An earlier one takes
it for one of the future, reads it and opens it for writing no more (docs/decisions/0011). So does a
journal that is still arriving: it is complete, but the one that it comes from is in force until
that is sealed.
"""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Final

from robolink.errors import JournalError
from robolink.journal.store import migrations, statements
from robolink.journal.store.connection import DatabaseConnection
from robolink.messages import joined, tr
from robolink.timing import local_label

SEALED: Final = 1000
"""Added to the version of the tables of a journal that is sealed as a whole."""

WHOLE: Final = ""
"""Name that stands for the records of all controllers."""

_TABLE: Final = "moved_records"
_GUARDED: Final = (*migrations.OF_CONTROLLERS, "markers", "entries", "checks")
_LOCKED: Final = (
    *migrations.OF_CONTROLLERS,
    *("markers", "check_head", "head", "entries", "checks"),
)
"""In the order in which writers use them: who locks in another might wait for each other."""


class MoveState(StrEnum):
    """How far a record has come."""

    MOVED = "moved"
    """It is in force at another place."""

    ARRIVING = "arriving"
    """It is complete here, and in force here once the other place is sealed."""


@dataclass(frozen=True, slots=True)
class Moved:
    """What a journal says about a record that was moved.

    Attributes:
        name: One name of the controller; :data:`WHOLE` for all.
        state: How far it has come.
        place: Location of the other journal, without a password.
        at: When, as a label.
        number, hash: Last entry of the journal that the record comes from.
    """

    name: str
    state: MoveState
    place: str
    at: str
    number: int
    hash: str


def keep_others_out(connection: DatabaseConnection) -> None:
    """Let only the caller's transaction write the journal; others read on."""
    if connection.lock_journal:
        connection.run(connection.lock_journal.format(tables=", ".join(_LOCKED)))


def moves_in(connection: DatabaseConnection) -> tuple[Moved, ...]:
    """Return what a journal says about moved records, nothing for one that says nothing."""
    if not connection.rows(connection.has_moves):
        return ()
    return tuple(
        Moved(name, MoveState(state), place, at, number, last_hash)
        for name, state, place, at, number, last_hash in connection.rows(statements.MOVES)
    )


def move_of(moves: Iterable[Moved], names: Sequence[str]) -> Moved | None:
    """Return the one of these that is about the whole journal, or about one of these names."""
    return next((move for move in moves if move.name in (WHOLE, *names)), None)


def seal(connection: DatabaseConnection, moves: Iterable[Moved]) -> None:
    """Let the database refuse to write these records, inside the caller's transaction."""
    moves = tuple(moves)
    connection.run(statements.MOVED_RECORDS)
    for guard in connection.guards:
        for table in _GUARDED if "{table}" in guard else ("",):
            connection.run(guard.format(table=table))
    for move in moves:
        connection.run(statements.ADD_MOVE, {**asdict(move), "state": str(move.state)})
    if any(move.name == WHOLE for move in moves):
        connection.run(statements.ADD_TO_VERSION, {"much": SEALED})


def take_into_use(connection: DatabaseConnection) -> None:
    """Let a journal that has arrived be written, inside the caller's transaction.

    Records of single controllers that were moved out of it before stay sealed.
    """
    connection.run(statements.TAKE_FROM_VERSION, {"much": SEALED})
    connection.run(statements.REMOVE_MOVE, {"name": WHOLE})
    if not moves_in(connection):
        _remove_guards(connection)


def discard_seals(connection: DatabaseConnection) -> None:
    """Remove whatever is sealed in a journal that was never in force, in the same way."""
    connection.run(statements.TAKE_FROM_VERSION, {"much": SEALED})
    _remove_guards(connection)


def _remove_guards(connection: DatabaseConnection) -> None:
    for guard in connection.unguards:
        for table in _GUARDED if "{table}" in guard else ("",):
            connection.run(guard.format(table=table))
    connection.run(f"DROP TABLE IF EXISTS {_TABLE}")


def moved_error(move: Moved, name: str, consequence: str = "") -> JournalError:
    """Return the error about a record that is no longer written here.

    Args:
        move: What the journal says about it.
        name: Which journal, as a person is told.
        consequence: What it means for the controller, one sentence.
    """
    place = shown(move.place)
    if move.state is MoveState.ARRIVING:
        what = tr(
            "The move of the journal {place} to {name} was interrupted.", place=place, name=name
        )
        remedy = tr(
            "Set ROBOLINK_JOURNAL={place}, then repeat the move: it goes on where it ended.",
            place=place,
        )
    else:
        when = local_label(move.at)
        if move.name == WHOLE:
            what = tr(
                "The journal {name} was moved to {place} on {when}.",
                name=name,
                place=place,
                when=when,
            )
        else:
            what = tr(
                "The record of {controller} was moved from {name} to {place} on {when}.",
                controller=move.name,
                name=name,
                place=place,
                when=when,
            )
        remedy = tr(
            "Name {place} in ROBOLINK_JOURNAL, or as journal in the cell file. The old journal can "
            "still be read.",
            place=place,
        )
    return JournalError(what, remedy=joined(" ", filter(None, (consequence, remedy))))


class MovedRecordError(JournalError):
    """The database refused to write a record that was moved.

    Args:
        moves: The records that were moved out of this journal; it is one of them.
        name: Which journal, as a person is told.
        consequence: What it means for the controller, one sentence.
    """

    def __init__(self, moves: Sequence[Moved], name: str, consequence: str) -> None:
        said = moved_error(moves[0], name, consequence)
        super().__init__(said.what, remedy=said.remedy)
        self._moves, self._name, self._consequence = moves, name, consequence

    def about(self, names: Sequence[str]) -> JournalError:
        """Return the error about the controller with these names."""
        move = move_of(self._moves, names)
        return self if move is None else moved_error(move, self._name, self._consequence)


def shown(location: str) -> str:
    """Return a journal's location as a person would name it: a file by its path."""
    return location.removeprefix("sqlite:///")
