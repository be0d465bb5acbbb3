"""Seats: one tablet at a time commands a cell; the others watch."""

from dataclasses import dataclass, field
from typing import Final

from robolink.messages import tr
from robolink.timing import NS_PER_S, Clock, SystemClock, local_label, wall_label
from robolink_cli.panel.guard.pairing import Tablet

SILENCE_S: Final = 120.0
"""After so long without a sign of its tablet, a seat at rest is free."""


@dataclass(frozen=True, slots=True)
class Holder:
    """Who commands a cell.

    Attributes:
        tablet: Id of the tablet.
        who: The person; empty for the panel's own PIN.
        address: Where the tablet is.
        since: When the seat was taken, as a label.
    """

    tablet: str
    who: str
    address: str
    since: str

    @property
    def sentence(self) -> str:
        """Who it is, for a person to read."""
        if not self.who:
            return tr(
                "The tablet at {address} has had the seat since {since}.",
                address=self.address,
                since=local_label(self.since),
            )
        return tr(
            "{who}, on the tablet at {address}, has had the seat since {since}.",
            who=self.who,
            address=self.address,
            since=local_label(self.since),
        )


@dataclass(slots=True)
class _Seat:
    holder: Holder
    heard_ns: int
    given_up: bool = False
    """Whether its person logged out while the robot moved."""


@dataclass(frozen=True, slots=True)
class Taking:
    """How it ended that a tablet wanted a seat.

    Attributes:
        why_not: Why it does not have it; empty where it does.
        from_whom: Who had it before; ``None`` for nobody, or this tablet itself.
    """

    why_not: str = ""
    from_whom: Holder | None = None


@dataclass(slots=True)
class Seats:
    """The seats of all cells.

    A seat is never taken from another tablet while the robot moves, whoever wants it and however
    long its tablet has been silent. Whether the robot moves, the caller says: ``None``, where
    nobody knows, counts as moving.

    Args:
        clock: In which silence counts.
    """

    clock: Clock = field(default_factory=SystemClock)
    _seats: dict[str, _Seat] = field(default_factory=dict)
    _lost: dict[tuple[str, str], Holder] = field(default_factory=dict)

    def take(self, cell: str, tablet: Tablet, *, moving: bool | None) -> Taking:
        """Take the seat of a cell.

        Args:
            cell: The cell.
            tablet: Which tablet; that it may command there was looked at before.
            moving: Whether the robot moves.
        """
        seat = self._seats.get(cell)
        before = None if seat is None or seat.holder.tablet == tablet.id else seat.holder
        if before is not None and moving is not False:
            return Taking(
                tr(
                    "{holder} The robot is moving: wait until it has stopped.",
                    holder=before.sentence,
                )
            )
        mine = Holder(tablet.id, tablet.who, tablet.address, wall_label())
        kept = seat is not None and before is None and seat.holder.who == mine.who
        self._seats[cell] = _Seat(seat.holder if seat and kept else mine, self.clock.now_ns())
        self._lost.pop((cell, tablet.id), None)
        if before is not None and not self._is_free(seat):
            self._lost[cell, before.tablet] = mine
            return Taking(from_whom=before)
        return Taking()

    def holder(self, cell: str, *, moving: bool | None = None) -> Holder | None:
        """Return who commands a cell, ``None`` for nobody.

        Args:
            cell: The cell.
            moving: Whether the robot moves; only at rest does a silent tablet lose its seat.
        """
        seat = self._seats.get(cell)
        if seat is None:
            return None
        if moving is False and self._is_free(seat):
            del self._seats[cell]
            return None
        return seat.holder

    def has(self, cell: str, tablet: str) -> bool:
        """Return whether a tablet commands a cell."""
        seat = self._seats.get(cell)
        return seat is not None and seat.holder.tablet == tablet and not seat.given_up

    def taken_by(self, cell: str, tablet: str) -> Holder | None:
        """Return who took the seat from this tablet, until it has it again."""
        return self._lost.get((cell, tablet))

    def heard(self, tablet: str) -> None:
        """Note a sign of life of a tablet."""
        now_ns = self.clock.now_ns()
        for seat in self._seats.values():
            if seat.holder.tablet == tablet:
                seat.heard_ns = now_ns

    def silent_s(self, cell: str) -> float | None:
        """Return how long the tablet that commands a cell has been silent; ``None`` without one."""
        seat = self._seats.get(cell)
        if seat is None or seat.given_up:
            return None
        return (self.clock.now_ns() - seat.heard_ns) / NS_PER_S

    def leave(self, cell: str, tablet: str, *, moving: bool | None) -> None:
        """Give a seat up; while the robot moves it stays, without a command, until it rests."""
        seat = self._seats.get(cell)
        if seat is None or seat.holder.tablet != tablet:
            return
        if moving is False:
            del self._seats[cell]
        else:
            seat.given_up = True

    def leave_all(self, tablet: str) -> tuple[str, ...]:
        """Give up all seats of a tablet that was logged out; return their cells."""
        cells = tuple(name for name, seat in self._seats.items() if seat.holder.tablet == tablet)
        for cell in cells:
            self._seats[cell].given_up = True
        return cells

    def _is_free(self, seat: _Seat | None) -> bool:
        if seat is None or seat.given_up:
            return True
        return self.clock.now_ns() - seat.heard_ns > SILENCE_S * NS_PER_S
