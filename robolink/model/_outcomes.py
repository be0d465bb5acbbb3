"""Durable markers of interrupted jobs, and what was found out about them."""

from collections.abc import Collection, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from enum import StrEnum
from typing import ClassVar, Protocol

from robolink import runtime
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model._identity import Who
from robolink.model._journal_entries import EntryKind, NewEntry, Recorded, Signature


class MarkerKind(StrEnum):
    """What a marker stands for."""

    SET = "set"
    MOVE = "move"
    SELECTION = "selection"
    CHANGE = "change"
    HISTORY = "history"


def new_operation() -> str:
    """Return a unique id for a command or a tool change."""
    return runtime.random_bytes(16).hex()


@dataclass(frozen=True, slots=True)
class Marker:
    """One command or procedure that was started.

    Attributes:
        operation: Unique id of the command.
        kind: ``SET`` a value is being written, ``MOVE`` the robot was told to move,
            ``SELECTION`` another tool than the cell's own is in force meanwhile, ``CHANGE`` a
            tool change is not finished: written and not verified, or not every tool of it,
            ``HISTORY`` the record of what was done here before is missing.
        request: What was sent or begun, as a person may read it.
        begun_at: Wall-clock label, ISO 8601 UTC.
        details: Plain JSON values needed to recover it.
    """

    operation: str
    kind: MarkerKind
    request: str
    begun_at: str
    details: Mapping[str, object] = field(default_factory=dict, hash=False)


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
    """Keeps the markers of one controller, if possible beyond the life of the process.

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
        """The controller's identity; it is asked at first use."""

    @property
    def names(self) -> tuple[str, ...]:
        """Every name under which the controller is recorded, its identity first."""

    @property
    def robot(self) -> str:
        """Which of several robots this record is about.

        Markers and the lease hold for the whole controller; tools, stations and what was done
        to them are on record of the current robot. Empty where there is one robot.
        """

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a person should know once about the controller's identity, in sentences."""

    def ask(self, who: Who) -> None:
        """Let the controller say who it is, at the next use and not before."""

    def begin(self, marker: Marker) -> None:
        """Store ``marker``; it is durable on return.

        Raises:
            ConfigError: It cannot be stored. The command must not be sent then.
        """

    def clear(self, operation: str, *entries: NewEntry) -> None:
        """Remove the marker and record how it ended; unknown ids are ignored.

        Raises:
            ConfigError: It cannot be recorded; the marker stays.
        """

    def append(self, *entries: NewEntry) -> None:
        """Record something; it is durable on return.

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
        """Return the unfinished jobs, oldest first."""

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

    def refuse_holder(self, *, silent: bool) -> None:
        """Refuse what another process of this computer would be in the way of; waits for nothing.

        Args:
            silent: Whether a process is meant that has the lease, still runs, and has not
                responded for so long that the lease may be taken; else one that responds.

        Raises:
            BusyError: There is such a process; the message names it.
            ConfigError: The record cannot be read.
        """

    def hold(self, purpose: str) -> AbstractContextManager[None]:
        """Keep the lease for the whole of a block, markers or not.

        Raises:
            BusyError: Another process has the controller.
        """

    def take_over(self, reason: str) -> None:
        """End the lease, whoever has it, at a person's request; this is recorded.

        Raises:
            ConfigError: It cannot be recorded.
        """

    def note_client(self, client: str) -> None:
        """Note the token under which a controller will be asked for its ownership.

        It raises nothing: it only helps whoever meets the token later.
        """

    def forget_client(self, client: str) -> None:
        """Forget the token: nothing is owned under it any more."""

    def run_of(self, client: str) -> ClientRun | None:
        """Return the run that noted a token, ``None`` if nobody noted it."""

    def beat(self) -> None:
        """Show others that this process is alive; cheap, and raises nothing."""

    def recorded(
        self, *, tool: int | None = None, change: str = "", kinds: Collection[EntryKind] = ()
    ) -> Iterator[Recorded]:
        """Return the records of this controller, newest first.

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
        """Release the lease; open markers stay, and block until they are recovered."""


class Verdict(StrEnum):
    """What reading the controller shows about an open marker."""

    DONE = "done"
    NOT_APPLIED = "not applied"
    NOT_FINISHED = "not finished"
    CONFLICT = "conflict"
    LOOK = "look"
    NOT_RESTORED = "not restored"

    @property
    def needs_a_person(self) -> bool:
        """Whether reading the controller is not enough to recover it."""
        return self in (Verdict.CONFLICT, Verdict.LOOK)


@dataclass(frozen=True, slots=True)
class Finding:
    """An open marker and what is true now.

    Attributes:
        marker: What was begun.
        verdict: What became of it.
        sentence: The same for a person.
        action: What settling it will do beyond forgetting it, empty for nothing.
        entries: What recovering it records.
    """

    json_version: ClassVar[int] = 5
    marker: Marker
    verdict: Verdict
    sentence: str
    action: str = ""
    entries: tuple[NewEntry, ...] = ()


class Resolver(Protocol):
    """Examines and recovers interrupted jobs on a controller."""

    def fence(self) -> None:
        """Make sure that nothing sent earlier and unanswered takes effect from here on.

        What is read before may be overtaken by a request that arrives late; so whoever settles
        something calls this first. It changes nothing that a person would notice, and does
        nothing where a link cannot deliver late, or was fenced off in this session already.

        Raises:
            LeaseHeldError: Another client has the controller.
            RobolinkError: It cannot be done now; nothing may be settled.
        """

    def examine(self, marker: Marker) -> Finding:
        """Read what is needed to judge ``marker``; changes nothing.

        Raises:
            ConfigError: The marker was written by something else.
        """

    def settle(self, finding: Finding) -> None:
        """Do what ``finding.action`` says and remove the marker."""


def begun_in_words(marker: Marker) -> str:
    """Return what a marker was stored for, without the statement that was sent.

    Args:
        marker: Of a movement with its ``target`` (mm, degrees), of a tool that was written or
            selected, or of anything else, which says itself what it is.
    """
    details = marker.details
    target = details.get("target")
    if marker.kind is MarkerKind.MOVE:
        if not isinstance(target, list) or len(target) < 4:
            return tr("a movement")
        x, y, z, u = (float(value) for value in target[:4])
        return tr("a movement to X {x:.3f} Y {y:.3f} Z {z:.3f} U {u:.3f}", x=x, y=y, z=z, u=u)
    if marker.kind is MarkerKind.SET and isinstance(details.get("select"), int):
        return tr("selecting tool {tool}", tool=details["select"])
    if marker.kind is MarkerKind.SET and isinstance(details.get("tool"), int):
        if details.get("requested") is None:
            return tr("clearing tool {tool}", tool=details["tool"])
        return tr("writing tool {tool}", tool=details["tool"])
    return marker.request
