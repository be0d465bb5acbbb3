"""The state of a controller after something was done to it, or was not.

Every error carries one (:attr:`robolink.errors.RobolinkError.controller_state`), and so does
whatever else ended a block in which a controller was used, Ctrl-C and a full disk included. It
is about what a controller keeps: tool offsets, the selected tool, outputs and variables; and
about whether the robot may still be moving. Power and speed are set before each movement and
are not part of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

__all__ = ["ControllerOutcome", "Effect", "ToolOutcome", "UNTOUCHED", "outcome_after"]

Components = tuple[float, ...] | None
"""x, y, z in mm and u, v, w in degrees; ``None`` for an undefined tool."""


class Effect(StrEnum):
    """What happened to the controller, in one word."""

    UNCHANGED = "unchanged"
    CHANGED = "changed"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class ToolOutcome:
    """One tool to which a write was sent.

    Attributes:
        before: What it held before the first of them, as it was read.
        holds: What it holds now, as it was read after the last; without meaning while ``known``
            is false.
        requested: What the last write was to put there.
        known: Whether it was read after the last write.
        differs: Whether what it holds is another value than before, to this controller's
            precision.
    """

    before: Components
    holds: Components
    requested: Components
    known: bool = True
    differs: bool = True


@dataclass(frozen=True, slots=True)
class ControllerOutcome:
    """What one block of work left on a controller.

    Attributes:
        tools: Tools to which a write was sent, by number.
        selected: Number of the selected tool as it was read last; ``None`` when it was not.
        selected_before: The same before the first selection; ``None`` when none was sent.
        selection_known: Whether the selected tool was read after the last selection.
        carried_out: Other requests that the controller has carried out: outputs, memory bits,
            variables, typed statements.
        doubtful: Other requests that may or may not have been carried out.
        moved: Whether a movement was begun.
        moving: Movements whose end was not seen.
        settled: Whether no write and no movement is left unproved or unrecorded, and no change
            that was neither kept nor taken back.
        left_open: Whether ``recover`` has something to do: what is not settled, or another tool
            than the cell's own that is still selected. The next command that moves or writes is
            refused until then.
        reset_first: Whether the controller, as it was seen last, needs a reset before anything
            else: ``recover`` is refused until then.
    """

    tools: Mapping[int, ToolOutcome] = field(default_factory=dict, hash=False)
    selected: int | None = None
    selected_before: int | None = None
    selection_known: bool = True
    carried_out: tuple[str, ...] = ()
    doubtful: tuple[str, ...] = ()
    moved: bool = False
    moving: tuple[str, ...] = ()
    settled: bool = True
    left_open: bool = False
    reset_first: bool = False

    @property
    def effect(self) -> Effect:
        """What happened to the controller, in one word."""
        proved = self.selection_known and all(tool.known for tool in self.tools.values())
        if self.doubtful or self.moving or not proved:
            return Effect.UNKNOWN
        written = any(tool.differs for tool in self.tools.values())
        if self.selected_another or written or self.carried_out:
            return Effect.CHANGED
        return Effect.UNCHANGED

    @property
    def untouched(self) -> bool:
        """Whether nothing was sent that changes or moves anything."""
        return not (
            self.tools
            or self.carried_out
            or self.doubtful
            or self.moved
            or self.selected_before is not None
        )

    @property
    def selected_another(self) -> bool:
        """Whether another tool is selected than before."""
        return self.selected_before not in (None, self.selected)

    def followed_by(self, later: "ControllerOutcome") -> "ControllerOutcome":
        """Return the outcome of the work of two connections, one after the other.

        Args:
            later: What the second one left. What it did not look at is as the first left it.
        """
        tools = dict(self.tools)
        for number, tool in later.tools.items():
            before = tools[number].before if number in tools else tool.before
            differs = tool.known and tool.holds != before
            tools[number] = replace(tool, before=before, differs=differs)
        looked = later.selected is not None or later.selected_before is not None
        chosen = self.selected_before is None
        return ControllerOutcome(
            tools=tools,
            selected=later.selected if looked else self.selected,
            selected_before=later.selected_before if chosen else self.selected_before,
            selection_known=later.selection_known if looked else self.selection_known,
            carried_out=(*self.carried_out, *later.carried_out),
            doubtful=(*self.doubtful, *later.doubtful),
            moved=self.moved or later.moved,
            moving=(*self.moving, *later.moving),
            settled=self.settled and later.settled,
            left_open=self.left_open or later.left_open,
            reset_first=later.reset_first,
        )

    def put_back(self) -> "ControllerOutcome":
        """Return the outcome once tools and selection were read and are as before, at rest."""
        return replace(
            self,
            tools={
                number: replace(tool, holds=tool.before, known=True, differs=False)
                for number, tool in self.tools.items()
            },
            selected=self.selected if self.selected_before is None else self.selected_before,
            selection_known=True,
            moving=(),
            settled=True,
            left_open=False,
        )


UNTOUCHED = ControllerOutcome()
"""The outcome if nothing was sent that changes or moves anything."""


def outcome_after(error: BaseException) -> ControllerOutcome:
    """Return what ``error``, of any kind, left on the controller."""
    found = getattr(error, "controller_state", UNTOUCHED)
    return found if isinstance(found, ControllerOutcome) else UNTOUCHED


def note_outcome(error: BaseException, outcome: ControllerOutcome) -> None:
    """Attach to ``error``, of any kind, what it left on the controller."""
    error.controller_state = outcome  # type: ignore[attr-defined]
