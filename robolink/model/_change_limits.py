"""How far a write may move a tool's tip at one cell, what is accepted beyond, and by whom."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from robolink.errors import NotAllowedError
from robolink.messages import joined, tr
from robolink.model._journal_entries import EntryKind, NewEntry
from robolink.model._outcomes import OutcomeLog
from robolink.model._tools import Jump, ToolOffset
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.stop_latch import StopLatch


class PersonRole(StrEnum):
    """The role of a person, by the cell file.

    An operator changes nozzles. Passing the jump limit, clearing a tool, undo, restore, writes
    without an expected value and raw statements take an engineer.
    """

    OPERATOR = "operator"
    ENGINEER = "engineer"


def require_engineer(outcomes: OutcomeLog, act: str, **details: object) -> None:
    """Refuse ``act`` to an operator, and record who else did it.

    Where the cell names no people, everybody may; it is recorded all the same.

    Args:
        outcomes: Where it goes on record.
        act: What it takes an engineer for.
        details: More for the record, plain JSON.

    Raises:
        NotAllowedError: The person is an operator.
        ConfigError: It cannot be recorded.

    Example:
        >>> import robolink
        >>> from robolink.model import require_engineer
        >>> with robolink.connect("epson+sim://engineer-example") as controller:
        ...     require_engineer(controller.outcomes, "accept a jump", tool=1)  # nobody is named
    """
    refuse_operator(outcomes, act)
    said = {**details, "engineer": True}
    outcomes.append(NewEntry(EntryKind.DECISION, verdict=act, details=said))


def refuse_operator(outcomes: OutcomeLog, act: str) -> None:
    """Refuse ``act`` to an operator; nothing is recorded.

    Args:
        outcomes: Knows who works here.
        act: What it takes an engineer for.

    Raises:
        NotAllowedError: The person is an operator.

    Example:
        >>> import robolink
        >>> from robolink.model import refuse_operator
        >>> with robolink.connect("epson+sim://operator-example") as controller:
        ...     refuse_operator(controller.outcomes, "accept a jump")  # nobody is named
    """
    signature = outcomes.signature
    if signature.role == PersonRole.OPERATOR:
        person = signature.operator or tr("somebody who gave no name")
        raise NotAllowedError(
            tr("{person} may not {act}. Ask an engineer.", person=person, act=act),
            remedy=tr(
                "Nothing was sent. Somebody listed as an engineer in the cell file "
                "may do it, with {operator}.",
                operator=remedy_word(RemedyWord.OPERATOR),
            ),
        )


_ROUNDING: Final = 0.002
"""Allowance for rounding, in mm and degrees: accepted values are compared as sent, with three
decimals per component."""


@dataclass(frozen=True, slots=True)
class ChangeLimits:
    """How far one write may move the tip of a tool.

    Attributes:
        length_mm: Largest change of its place, ``None`` where nothing is said.
        angle_deg: Largest change of its orientation, ``None`` where nothing is said.
    """

    length_mm: float | None = None
    angle_deg: float | None = None

    def exceeded_by(self, jump: Jump) -> bool:
        """Return whether a jump is larger."""
        return jump.exceeds(self.length_mm, self.angle_deg)

    def figure(self, tool: int, jump: Jump) -> str:
        """Return by how much a jump is larger, in sentences."""
        return joined(" ", filter(None, (self._moved(tool, jump), self._turned(tool, jump))))

    def findings(self, tool: int, jump: Jump) -> str:
        """Return by how much a jump is larger: one sentence, or a list where both limits are."""
        moved, turned = self._moved(tool, jump), self._turned(tool, jump)
        if not (moved and turned):
            return moved or turned
        return tr(
            "Tool {tool} would change by more than this cell allows:\n    {moved}\n    {turned}",
            tool=tool,
            moved=moved,
            turned=turned,
        )

    def _moved(self, tool: int, jump: Jump) -> str:
        if self.length_mm is None or jump.length_mm <= self.length_mm:
            return ""
        return tr(
            "The tip of tool {tool} would move {change:.3f} mm; this cell allows {limit:.3f}.",
            tool=tool,
            change=jump.length_mm,
            limit=self.length_mm,
        )

    def _turned(self, tool: int, jump: Jump) -> str:
        if self.angle_deg is None or jump.angle_deg <= self.angle_deg:
            return ""
        return tr(
            "Tool {tool} would turn by {turn:.3f} degrees; this cell allows {limit:.3f}.",
            tool=tool,
            turn=jump.angle_deg,
            limit=self.angle_deg,
        )


class ChangeGuard:
    """Refuses every write that moves a tip farther than the cell allows.

    Whoever writes a tool passes it, typed or measured, from Python or by a command; what is put
    back does not (docs/reference/rules.md 2). A tool that is undefined has no place from which its
    tip could jump.

    Attributes:
        limits: Those of the cell. Where only a URL is known there are none.

    Args:
        outcomes: Where it goes on record what an engineer accepts.
        latch: Knows whether a thread puts back what was there before.

    Example:
        >>> import robolink
        >>> from robolink.errors import NotAllowedError
        >>> from robolink.model import ChangeLimits, Jump, ToolOffset
        >>> limits = ChangeLimits(length_mm=2)
        >>> with robolink.connect("epson+sim://guard-example", limits=limits) as controller:
        ...     before = controller.tools.read(1)
        ...     far = ToolOffset(before.x_mm + 5, before.y_mm, before.z_mm)
        ...     try:
        ...         controller.tools.write(1, far, expected=before)
        ...     except NotAllowedError as error:
        ...         print(error.what)
        ...     with controller.change_guard.accepting(1, Jump.between(before, far)):
        ...         receipt = controller.tools.write(1, far, expected=before)
        The tip of tool 1 would move 5.000 mm; this cell allows 2.000.
    """

    def __init__(self, outcomes: OutcomeLog, latch: StopLatch) -> None:
        self.limits = ChangeLimits()
        self._outcomes = outcomes
        self._latch = latch
        self._accepted: dict[int, Jump] = {}

    def beyond(self, before: ToolOffset | None, after: ToolOffset | None) -> Jump | None:
        """Return how far a tip would be moved, if that is farther than the cell allows."""
        if before is None or after is None:
            return None
        jump = Jump.between(before, after)
        return jump if self.limits.exceeded_by(jump) else None

    def require(self, tool: int, before: ToolOffset | None, after: ToolOffset | None) -> None:
        """Refuse a change beyond the limits that is neither accepted nor a restore.

        Args:
            tool: Number of the tool.
            before: What it holds, ``None`` for undefined.
            after: What it is to hold, ``None`` to be cleared.

        Raises:
            NotAllowedError: Names the figure; nothing was sent.

        Example:
            >>> from robolink.model import ChangeLimits, ToolOffset
            >>> from robolink.controllers import SimpleController
            >>> guard = SimpleController().change_guard
            >>> guard.limits = ChangeLimits(length_mm=2)
            >>> guard.require(1, ToolOffset(x_mm=12), ToolOffset(x_mm=13.5))
        """
        jump, accepted = self.beyond(before, after), self._accepted.get(tool)
        if jump is None or self._latch.restores:
            return
        if accepted is not None and not jump.exceeds(
            accepted.length_mm + _ROUNDING, accepted.angle_deg + _ROUNDING
        ):
            return
        raise NotAllowedError(
            self.limits.findings(tool, jump),
            remedy=tr(
                "Nothing was written. Check sign and unit. If the change is real, an engineer "
                "may accept it: {accept_change}.",
                accept_change=remedy_word(RemedyWord.ACCEPT_CHANGE),
            ),
        )

    @contextmanager
    def accepting(self, tool: int, jump: Jump) -> Iterator[None]:
        """Allow the tip of a tool to be moved this far within the block; this is recorded.

        Args:
            tool: Number of the tool.
            jump: How far; what an engineer was shown.

        Raises:
            NotAllowedError: The person is an operator.
            ConfigError: It cannot be recorded.
        """
        require_engineer(
            self._outcomes,
            tr(
                "accept a jump of tool {tool} by {change:.3f} mm and {turn:.3f} degrees",
                tool=tool,
                change=jump.length_mm,
                turn=jump.angle_deg,
            ),
        )
        before = self._accepted.get(tool)
        self._accepted[tool] = jump
        try:
            yield
        finally:
            if before is None:
                self._accepted.pop(tool, None)
            else:
                self._accepted[tool] = before
