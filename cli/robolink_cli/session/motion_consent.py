"""Asking before the robot moves: who stopped it, which tool is selected, is the cell clear?"""

from typing import TYPE_CHECKING, Final

import click

from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink_cli.prompts import questions
from robolink_cli.prompts.questions import WATCHED
from robolink_cli.session.selected_tool import heed_selection
from robolink_cli.stopping.notes import heed_stop

if TYPE_CHECKING:
    from robolink.model import Controller

CELL: Final = "robolink.cell"
"""Where the cell is found that was named, ``None`` for none."""

REACHED: Final = "robolink.reached"
"""Where it is found by which URL that controller was reached."""


def agree_to_motion(question: str, *, yes: bool, in_tool: bool = True) -> None:
    """Ask before the robot moves; without a terminal only ``--yes`` is consent.

    Args:
        question: What will happen.
        yes: Whether the answer was given beforehand.
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
    if not questions.on_terminal():
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
