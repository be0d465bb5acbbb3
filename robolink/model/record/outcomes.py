"""Durable markers of what was begun and not proved finished."""

from collections.abc import Collection, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol

from robolink import ambient
from robolink.errors import ConfigError
from robolink.model._identity import Who
from robolink.model.record.journal_entries import EntryKind, NewEntry, Recorded, Signature


class MarkerKind(StrEnum):
    """What a marker stands for."""

    SET = "set"
    MOVE = "move"
    SELECTION = "selection"
    CHANGE = "change"
    HISTORY = "history"


def new_operation() -> str:
    """Return a unique id for a command or a tool change."""
    return ambient.random_bytes(16).hex()


@dataclass(frozen=True, slots=True)
class Marker:
    """One command or procedure that was begun.

    Attributes:
        operation: Unique id of the command.
        kind: ``SET`` a value is being written, ``MOVE`` the robot was told to move,
            ``SELECTION`` another tool than the cell's own is in force meanwhile, ``CHANGE`` a
            tool change is not finished: written and not verified, or not every tool of it,
            ``HISTORY`` the record of what was done here before is missing.
        request: What was sent or begun, as a person may read it.
        begun_at: Wall-clock label, ISO 8601 UTC.
        details: Plain JSON values needed to settle it.
    """

    operation: str
    kind: MarkerKind
    request: str
    begun_at: str
    details: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ClientRun:
    """A run of robolink that took a controller under a token.

    Attributes:
        who: Person, process and computer, as a person is told.
        since: When it asked, a wall-clock label.
        lives: Whether its process still runs; ``None`` where that cannot be seen from here.
    """

    who: str
    since: str
    lives: bool | None


class OutcomeLog(Protocol):
    """Keeps the markers of one controller, beyond the life of the process where it can.

    Attributes:
        signature: Who works here, and with what.
        change: Id of the tool change under way, empty for none; it goes with every entry.
        order: Id of the order that is carried out, empty for none; it stands in the details of
            every entry.
        trouble: Why nothing can be recorded, so that nothing may be changed; ``None`` for a
            record that is as it should be.
    """

    signature: Signature
    change: str
    order: str

    @property
    def trouble(self) -> ConfigError | None:
        """See above."""

    @property
    def durable(self) -> bool:
        """Whether what is recorded outlives this process."""

    @property
    def identity(self) -> str:
        """Who the controller is; it is asked if it was not asked yet."""

    @property
    def names(self) -> tuple[str, ...]:
        """Every name under which the controller is on record, its identity first."""

    @property
    def robot(self) -> str:
        """Of a controller with several robots the name of the one whose record this is.

        Markers and the lease hold for the whole controller; tools, stations and what was done
        to them are on record of the robot in force. Empty where there is one robot.
        """

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a person should know about who the controller is, once, in sentences."""

    def ask(self, who: Who) -> None:
        """Let the controller say who it is, at the next use and not before."""

    def begin(self, marker: Marker) -> None:
        """Store ``marker``; it is durable when this returns.

        Raises:
            ConfigError: It cannot be stored. The command must not be sent then.
        """

    def clear(self, operation: str, *entries: NewEntry) -> None:
        """Forget the marker and record how it ended; unknown ids are ignored.

        Raises:
            ConfigError: It cannot be recorded; the marker stays.
        """

    def append(self, *entries: NewEntry) -> None:
        """Put something on record; it is durable when this returns.

        Raises:
            ConfigError: It cannot be recorded.
        """

    def answered(self, entry: NewEntry) -> None:
        """Keep an answer (:func:`answer_entry`) for the change that it may lead to.

        It goes on record in the transaction in which that begins, under its id: with the first
        entry of a tool change, of a write, of a selection or of the place of a station. An answer
        that nothing follows is kept nowhere: nothing rests on it.
        """

    def open_markers(self) -> tuple[Marker, ...]:
        """Return what is unsettled, oldest first."""

    def look(self) -> None:
        """Note the state of the lease; a later :meth:`begin` fails if it changed meanwhile.

        Raises:
            BusyError: Another process has the controller.
        """

    def at_work(self) -> str:
        """Return who else is working on the controller, in sentences; empty for nobody.

        Raises:
            ConfigError: The record cannot be read.
        """

    def hold(self, purpose: str) -> AbstractContextManager[None]:
        """Keep the lease for the whole of a block, markers or not.

        Raises:
            BusyError: Another process has the controller.
        """

    def take_over(self, reason: str) -> None:
        """End the lease of whoever has it, because a person insists; this is recorded.

        Raises:
            ConfigError: It cannot be recorded.
        """

    def note_client(self, client: str) -> None:
        """Note, before a controller is asked for its ownership, under which token that is done.

        It raises nothing: it only helps whoever meets the token later.
        """

    def forget_client(self, client: str) -> None:
        """Forget the token again: nothing is owned under it any more."""

    def run_of(self, client: str) -> ClientRun | None:
        """Return the run that noted a token, ``None`` for a token that nobody noted."""

    def beat(self) -> None:
        """Let others see that this process is alive; cheap, and raises nothing."""

    def recorded(
        self, *, tool: int | None = None, change: str = "", kinds: Collection[EntryKind] = ()
    ) -> Iterator[Recorded]:
        """Return what is on record about this controller, newest first.

        Args:
            tool: Only entries about this tool.
            change: Only entries of this tool change.
            kinds: Only entries of these kinds.

        Raises:
            ConfigError: The record cannot be read.

        Example:
            >>> import robolink
            >>> from robolink.model import EntryKind
            >>> with robolink.connect("epson+sim://recorded-example") as controller:
            ...     new = robolink.ToolOffset(5, 6, -70)
            ...     receipt = controller.tools.write(2, new, expected=None)
            ...     [done] = controller.outcomes.recorded(tool=2, kinds=[EntryKind.DONE])
            >>> done.tool
            2
        """

    def close(self) -> None:
        """Give the lease up; open markers stay, and block until they are settled."""
