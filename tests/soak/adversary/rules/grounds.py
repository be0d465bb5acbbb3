"""The rules' data about the present hour, and their evaluation."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from robolink.calibration_run import ChangeReport
from robolink.model import ToolOffset
from tests.soak.adversary.books import BookedMarker, Books
from tests.soak.adversary.history import Hour, Story
from tests.soak.adversary.people import Wish
from tests.soak.adversary.plant.machine import MachineState, PlantMachine

NAMES: Final = (
    "MovesOnce",
    "StillAfterStop",
    "NoSuccessAfterStop",
    "AtRestWhenStopped",
    "OnlyWantedValues",
    "KeptOnProof",
    "NoMotionInDoubt",
    "SessionEnds",
    "AllOrNone",
    "TakenBack",
    "NothingWithoutRecord",
    "LossIsNoticed",
    "NoWriteWithoutLease",
    "BooksAgree",
    "ExitCodeIsTrue",
    "StateIsTold",
    "SameToolSelected",
    "TipIsWhereItSays",
    "NoProofWithoutTouch",
    "NoDefectShown",
    "UsableAgain",
    "NoPasswordShown",
    "NothingGrows",
    "ContractHolds",
    "AsBefore",
    "AskedValue",
    "ByHandStays",
    "MovesInItsTool",
    "NothingMovesOn",
    "NothingOutlives",
    "JournalKept",
)
"""Every rule, in the order in which they are listed."""

SURELY_MM: Final = 0.5
"""A certified tip farther away than this is a wrong certificate in any case."""

TOLERANCE_MM: Final = 0.1
"""The tolerance for the touches of a program's turn test."""


@dataclass(slots=True)
class HourSoFar:
    """The rules' data about the present hour.

    Attributes:
        hour: The hour.
        wish: The state that its person intends at its end.
        first: The machine's state at its beginning.
        before: The state at the beginning of the last try.
        agreed: The state when its person last agreed to a change: one deed may make several.
        entries: The newest entry at its beginning.
        old_markers: The markers open before the last try, by operation.
        moves: Operations under which a movement has left, with counts.
        movements: The number of movements that the machine had begun.
        wanted: The values that each tool may hold.
        report: The report about a tip that was measured and tested.
        last_move: The last movement that has left.
        writes: The first write that has left under each marker, by operation.
        crowded: Whether a second person was at work.
        typed_by_others: Their typed values, by tool.
        settled_by_others: Tools of open jobs when a second person began to recover.
        chosen_by_hand: Tools that somebody selected at the machine.
    """

    hour: Hour
    wish: Wish
    first: MachineState
    before: MachineState
    entries: int
    old_markers: frozenset[str]
    movements: int
    agreed: MachineState
    moves: dict[str, int] = field(default_factory=dict)
    wanted: dict[int, list[ToolOffset | None]] = field(default_factory=dict)
    report: ChangeReport | None = None
    last_move: str = ""
    writes: dict[str, str] = field(default_factory=dict)
    crowded: bool = False
    typed_by_others: list[tuple[int, ToolOffset]] = field(default_factory=list)
    settled_by_others: set[int] = field(default_factory=set)
    chosen_by_hand: list[int] = field(default_factory=list)


class Grounds:
    """The data of every rule: the machine and the journal as they are, the hour so far.

    Args:
        story: Receives broken rules.
        plant: The machine.
        books: The journal on the disk.

    Attributes:
        plant: The machine.
        books: The journal on the disk.
        now: The present hour.
        story: Receives broken rules.
        staged: Values in registers that wait for a request, left by a write whose record the disk
            has lost: the next request may activate them.
        doubted: Tools for which a person was told that their registers are not recorded, and that
            only the machine's screen shows the value in use.
    """

    now: HourSoFar

    def __init__(self, story: Story, plant: PlantMachine, books: Books) -> None:
        self.story = story
        self.plant = plant
        self.books = books
        self.staged: dict[int, ToolOffset] = {}
        self.doubted: set[int] = set()

    def from_a_lost_write(self, tool: int, holds: ToolOffset | None) -> bool:
        """Return whether a value is one that nobody could know to wait for a request."""
        staged = self.staged.get(tool)
        return staged is not None and self.plant.same(staged, holds)

    def came_from_a_lost_write(self, tool: int, holds: ToolOffset | None) -> bool:
        """Return whether a request activated a value that nobody could know to be waiting.

        A write had ended between its registers and its request, and the disk lost the record of it.
        A person must have been told, if the record could show it.
        """
        known, _ = self.books.value_of(tool)
        return self.from_a_lost_write(tool, holds) and (tool in self.doubted or not known)

    def hold(self, rule: str, holds: bool, sentence: str) -> None:
        """Check a rule; ``sentence`` is the observation if it is broken."""
        self.story.checks[rule] += 1
        if not holds:
            self.story.break_rule(rule, sentence)

    def open_selection(self) -> list[BookedMarker]:
        """Return the markers by which a tool other than the cell's own may be selected."""
        if not self.books.trusted:
            return [BookedMarker("", "selection", "", {})]
        return [m for m in self.books.markers() if m.kind == "selection" or "select" in m.details]


def chain(error: BaseException | None) -> Iterator[BaseException]:
    """Yield an error and its causes."""
    seen: list[BaseException] = []
    while error is not None and not any(error is one for one in seen):  # it may be its own cause
        seen.append(error)
        error = error.__cause__ or error.__context__
    yield from seen
