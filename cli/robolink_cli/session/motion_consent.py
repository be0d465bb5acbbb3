"""Asking before the robot moves: who stopped it, which tool is selected, is the cell clear?"""

from contextlib import suppress
from typing import TYPE_CHECKING, Final

import click

from robolink.errors import DeclinedError, JournalError
from robolink.messages import tr
from robolink.model import EntryKind
from robolink_cli.console.person import person_here
from robolink_cli.prompts import questions
from robolink_cli.prompts.questions import WATCHED
from robolink_cli.stopping.notes import heed_stop

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robolink.config import Expected
    from robolink.model import Controller


def doubt_about(selected: int | None, controller: "Controller", cell: "Expected | None") -> str:
    """Return why the selected tool may be the wrong one, one sentence; empty for no doubt.

    Args:
        selected: The selected tool, ``None`` where the controller does not tell.
        controller: The controller, connected.
        cell: What the cell file says, if a cell was named.
    """
    if selected is None:
        return ""
    if cell is not None and cell.tool is not None:
        if cell.tool == selected:
            return ""
        return tr(
            "Tool {selected} is selected, but the cell {cell} uses tool {tool}.",
            selected=selected,
            cell=cell.cell,
            tool=cell.tool,
        )
    before = _of_the_last_procedure(controller) if selected == 0 else 0
    if not before:
        return ""
    return tr(
        "Tool 0 (flange) is selected; the last procedure began with tool {tool}.",
        tool=before,
    )


def heed_selection(controller: "Controller", cell: "Expected | None", *, yes: bool) -> None:
    """Ask before something moves with a tool that may be the wrong one.

    ``--yes`` was given before anybody could know of it, so it is no answer.

    Raises:
        DeclinedError: The answer was no, or nobody could be asked.
    """
    from robolink_cli.console.render import json_is_on
    from robolink_cli.prompts.questions import asked

    if controller.outcomes.open_markers():
        return  # they block it themselves, with more detail
    doubt = doubt_about(controller.tools.selected(), controller, cell)
    if not doubt:
        return
    remedy = tr(
        "Nothing moved. Another program may have selected it. Select the tool that the cell "
        "file names: robolink tool select N"
    )
    if yes or json_is_on() or not person_here():
        raise DeclinedError(doubt, remedy=remedy)
    if not asked(tr("{doubt} Move with it anyway?", doubt=doubt)):
        raise DeclinedError(doubt, remedy=remedy)


def note_doubts(
    payload: "Mapping[str, object]", controller: "Controller", cell: "Expected | None"
) -> None:
    """Show, beside a controller's state, what other programs seem to have left on it.

    Args:
        payload: The state, as ``status`` shows it.
        controller: The controller, connected; nothing was sent but questions.
        cell: What the cell file says, if a cell was named.
    """
    from robolink_cli.console.render import note

    selected = payload.get("selected_tool")
    doubt = doubt_about(selected if isinstance(selected, int) else None, controller, cell)
    if doubt:
        note(doubt)
    if payload.get("owned"):
        # This command only asks, so it is not the owner.
        note(
            tr(
                "Another client has the mailbox locked: a program here, or on another "
                "computer. Until it ends, robolink cannot move or write."
            )
        )


def _of_the_last_procedure(controller: "Controller") -> int:
    """Return the tool selected before the last recorded procedure, 0 for none."""
    with suppress(JournalError):
        for entry in controller.outcomes.recorded(kinds=(EntryKind.SELECTION,)):
            return entry.tool or 0
    return 0


CELL: Final = "robolink.cell"
"""Key of the cell that was given, ``None`` for none."""

REACHED: Final = "robolink.reached"
"""Key of the URL by which the controller was reached."""


def agree_to_motion(question: str, *, yes: bool, in_tool: bool = True) -> None:
    """Ask before the robot moves; without a terminal only ``--yes`` is consent.

    Args:
        question: What will happen.
        yes: Whether the answer was given in advance.
        in_tool: Whether it matters which tool is selected.

    Raises:
        StoppedError: Somebody stopped this controller, and nobody has released it since.
        DeclinedError: The answer was no, or nobody could be asked; or the selected tool may be
            a wrong one.
    """
    heed_what_was_left(yes=yes, in_tool=in_tool)
    if yes:
        questions.agree(question, yes=True)
        return
    if not person_here():
        raise DeclinedError(
            tr("The robot would move, but there is nobody to ask."),
            remedy=tr("Add --yes when the cell is clear, or run it on a terminal."),
        )
    questions.require_yes(question)


def heed_what_was_left(*, yes: bool, in_tool: bool = True) -> None:
    """Ask about what others left on the controller, before the robot moves.

    Raises:
        StoppedError, DeclinedError: As :func:`agree_to_motion`.
    """
    meta = click.get_current_context().meta
    if REACHED in meta:
        heed_stop(meta[REACHED], meta[WATCHED], yes=yes)
    if in_tool and WATCHED in meta:
        heed_selection(meta[WATCHED], meta.get(CELL), yes=yes)


def motion_question(
    controller: "Controller", purpose: str, *, speed_mm_s: float, box_mm: float
) -> str:
    """Return the question before something moves: what, how fast, how far, what for.

    Raises:
        NotReadyError: Nothing can move now, for example because the motors are off; nobody is
            asked then.
    """
    group = controller.groups[0]
    group.require_able(purpose)
    terms = group.terms()
    return tr(
        "{who} will move by itself {purpose}: up to {speed:g} mm/s, at most {box:g} mm from "
        "here. {watch} Is everybody out of the cell?",
        who=terms.who,
        speed=speed_mm_s,
        box=box_mm,
        purpose=purpose,
        watch=terms.watch,
    )
