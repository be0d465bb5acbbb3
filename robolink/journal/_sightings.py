"""A lease as somebody sees it."""

import json
from dataclasses import asdict, dataclass
from typing import Final

from robolink.errors import LeaseHeldError
from robolink.journal._processes import LeaseHolder
from robolink.messages import tr
from robolink.model import EntryKind, NewEntry
from robolink.timing import local_label

LEASE_S: Final = 10.0
"""A holder that gave no sign of life for so long may be replaced."""

FREE: Final = ""
"""The token of a lease that nobody holds."""


@dataclass(frozen=True, slots=True)
class LeaseSighting:
    """A lease as it was seen.

    Attributes:
        epoch: How many holders there were; 0 for a lease that never was held.
        token: Id of the holder, empty when it is free.
        beat: Counter of the signs of life.
        beat_ns: The last one, in the holder's time since the start of his system.
        holder: The holder as JSON.
        taken_at: Since when, as a label.
        purpose: What for.
    """

    epoch: int = 0
    token: str = FREE
    beat: int = 0
    beat_ns: int = 0
    holder: str = "{}"
    taken_at: str = ""
    purpose: str = ""

    def who(self) -> LeaseHolder:
        """Return the holder, nobody known when the record of him is damaged."""
        try:
            return LeaseHolder(**json.loads(self.holder))
        except (ValueError, TypeError, RecursionError):
            return LeaseHolder()

    def held_error(self, controller: str, last_sign: str) -> LeaseHeldError:
        """Return the error that names the holder.

        Args:
            controller: Whose lease it is.
            last_sign: When the holder gave its last sign of life, in words.
        """
        return LeaseHeldError(
            tr(
                "{holder} has been working on {controller} since {since}: {purpose}. "
                "Last sign of life: {sign}.",
                holder=describe(self.who()),
                controller=controller,
                since=local_label(self.taken_at),
                purpose=self.purpose,
                sign=last_sign,
            ),
            remedy=tr(
                "Nothing was sent. Wait until it has finished, or end it; after {seconds:.0f} s "
                "without a sign of life it may be replaced.",
                seconds=LEASE_S,
            ),
            controller=controller,
        )

    def at_work(self, alive: str) -> str:
        """Return the sentences about a holder who is at it.

        Args:
            alive: Whether he lives, one sentence.
        """
        said = tr(
            "{holder} has been at work on this controller since {since}: {purpose}.",
            holder=describe(self.who()),
            since=local_label(self.taken_at),
            purpose=self.purpose,
        )
        return f"{said} {alive}"

    def took_over(self, controller: str) -> str:
        """Return the sentence about the holder who has it now, or had it last.

        Args:
            controller: Whose lease it is.
        """
        if self.who() == LeaseHolder():
            return tr("Somebody else took over {controller} meanwhile.", controller=controller)
        return tr(
            "{holder} took over {controller} on {since}: {purpose}.",
            holder=describe(self.who()),
            controller=controller,
            since=local_label(self.taken_at),
            purpose=self.purpose,
        )

    def taken_entry(self, because: str, insisting: LeaseHolder | None = None) -> NewEntry:
        """Return what is put on record when this lease was ended by another.

        Args:
            because: Why that could be done, in words.
            insisting: The person who had it ended, whoever held it; ``None`` where nobody
                had to insist.
        """
        if self.token == FREE:
            verdict = tr("Nobody worked on this cell; {because}.", because=because)
        else:
            holder = describe(self.who())
            verdict = (
                tr(
                    "{holder} was at work on this controller before: {because}.",
                    holder=holder,
                    because=because,
                )
                if insisting is None
                else tr(
                    "{insisting} insisted on taking this controller over from {holder}: {because}.",
                    insisting=describe(insisting),
                    holder=holder,
                    because=because,
                )
            )
        details = {
            "epoch": self.epoch + 1,
            "holder": asdict(self.who()),
            "since": self.taken_at,
            "purpose": self.purpose,
            "reason": because,
            **({} if insisting is None else {"insisted": asdict(insisting)}),
        }
        return NewEntry(EntryKind.LEASE, verdict=verdict, details=details)

    def is_like(self, other: "LeaseSighting") -> bool:
        """Whether nothing happened between two sightings."""
        return (self.epoch, self.token, self.beat) == (other.epoch, other.token, other.beat)


def describe(holder: LeaseHolder) -> str:
    """Return who it is, as a person is told."""
    if holder == LeaseHolder():
        return tr("Somebody unknown")
    process = tr("process {pid} on {host}", pid=holder.pid, host=holder.host)
    if holder.operator and holder.operator != holder.os_user:
        return tr(
            "{operator} ({os_user}, {process})",
            operator=holder.operator,
            os_user=holder.os_user,
            process=process,
        )
    return tr("{os_user} ({process})", os_user=holder.os_user or "?", process=process)
