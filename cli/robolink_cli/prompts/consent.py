"""Asking before something changes, and the options that answer beforehand."""

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import click

from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink_cli.session.context import CELL, REACHED, WATCHED

if TYPE_CHECKING:
    from robolink.model import Controller

F = TypeVar("F", bound=Callable[..., Any])


def dry_run_option(function: F) -> F:
    """Add ``--dry-run``."""
    return click.option(
        "--dry-run",
        is_flag=True,
        help="Show the exact requests and check the limits; read only, write nothing.",
    )(function)


def yes_option(function: F) -> F:
    """Add ``--yes``."""
    return click.option("--yes", is_flag=True, help="Answer yes to the question asked.")(function)


def then_select_option(function: F) -> F:
    """Add ``--then-select``."""
    return click.option(
        "--then-select",
        type=click.IntRange(0, 15),
        metavar="NUMBER",
        help=tr(
            "The tool that the machine is to have selected in place of one that is selected and "
            "loses its definition; 0 is the flange."
        ),
    )(function)


def published_option(function: F) -> F:
    """Add ``--published``."""
    return click.option(
        "--published",
        is_flag=True,
        help="The tools as the companion program published them; works while production runs.",
    )(function)


def on_terminal() -> bool:
    """Tell whether a person can be asked."""
    return sys.stdin.isatty() and sys.stderr.isatty()


def agree(question: str, *, yes: bool) -> None:
    """Ask on a terminal; off it, the command itself is the consent (docs/reference/rules.md 7).

    Raises:
        DeclinedError: The answer was no.
    """
    if not yes and on_terminal():
        _require_yes(question)


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
    meta = click.get_current_context().meta
    if REACHED in meta:
        from robolink_cli.stopping.notes import heed_stop

        heed_stop(meta[REACHED], meta[WATCHED], yes=yes)
    if in_tool and WATCHED in meta:
        from robolink_cli.session.selected_tool import heed_selection

        heed_selection(meta[WATCHED], meta.get(CELL), yes=yes)
    if yes:
        return
    if not on_terminal():
        raise DeclinedError(
            tr("The robot would move, and nobody can be asked here."),
            remedy=tr("Run it on a terminal, or give --yes when the cell is clear."),
        )
    _require_yes(question)


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
        "{who} will move at most {speed:g} mm/s fast, within {box:g} mm, {purpose}. {watch} "
        "Is the cell clear?",
        who=terms.who,
        speed=speed_mm_s,
        box=box_mm,
        purpose=purpose,
        watch=terms.watch,
    )


def asked(question: str) -> bool:
    """Ask for a yes; anything else is a no (:func:`robolink.runner.ask_yes_no` says what is)."""
    from robolink.runner import ask_yes_no
    from robolink_cli.prompts.operator import terminal

    return ask_yes_no(terminal(), question, _answer)


def asked_for_text(question: str) -> str:
    """Ask for a line of text.

    Raises:
        DeclinedError: None was typed, or ``q``.
    """
    from robolink.runner import Question
    from robolink_cli.prompts.operator import terminal

    terminal().ask(question, Question.TEXT)
    text = _answer().strip()
    if text in ("", "q"):
        raise DeclinedError(tr("No answer was given."), remedy=tr("Nothing was sent."))
    return text


def _answer() -> str:
    """Return the next line, reading the status between polls of the prompt.

    An idle client is cut off after the remote time-out (docs/reference/epson.md 1.1), and a person
    may take longer than that to look into the cell.
    """
    from robolink.runner import POLL_S
    from robolink_cli.prompts.operator import terminal

    controller = click.get_current_context().meta.get(WATCHED)
    operator = terminal()
    while (line := operator.poll(POLL_S)) is None:
        if controller is not None:
            controller.status()
    return line


def _require_yes(question: str) -> None:
    if not asked(question):
        raise DeclinedError(tr("You said no."), remedy=tr("Nothing was sent."))
