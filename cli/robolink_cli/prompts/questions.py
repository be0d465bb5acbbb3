"""Asking a person at the terminal before something changes.

Every answer is kept, for the record of what follows from it: here, not by whoever asks. A value
that is typed and takes the tip farther than the cell allows asks who may: a slip of the fingers, a
sign or a unit takes it as far as no nozzle change explains.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.person import Person, person_here
from robolink_cli.console.render import json_is_on
from robolink_cli.options.declaration import CliOption

if TYPE_CHECKING:
    from robolink.model import AnsweredBy, Controller, Jump


WATCHED: Final = "robolink.watched"
"""Key of the controller whose status a prompt must read while a person thinks."""


def agree(question: str, *, yes: bool, asks: bool = True) -> None:
    """Ask on a terminal; off it, the command itself is the consent (docs/reference/rules.md 7).

    Args:
        question: What a yes agrees to.
        yes: Whether it was answered in advance.
        asks: Whether a person may be asked where there is a terminal.

    Raises:
        DeclinedError: The answer was no.
    """
    from robolink.model import AnsweredBy

    if not yes and asks and person_here():
        require_yes(question)
        return
    keep_answer(question, True, AnsweredBy.YES if yes else AnsweredBy.COMMAND)


def asked(question: str) -> bool:
    """Ask for a yes; anything else is a no (:func:`robolink.runner.ask_yes_no` says what is)."""
    from robolink.model import AnsweredBy
    from robolink.runner import ask_yes_no
    from robolink_cli.prompts.operator import terminal

    said = ask_yes_no(terminal(), question, _answer)
    keep_answer(question, said, AnsweredBy.PERSON)
    return said


def keep_answer(
    question: str, answer: bool | str, by: "AnsweredBy", *, tool: int | None = None
) -> None:
    """Keep an answer for what follows from it; see :meth:`robolink.model.OutcomeLog.answered`.

    Where no controller is connected yet there is nothing that it could be kept for.

    Args:
        question: What was asked, as it was shown.
        answer: Whether it was a yes, or the text itself.
        by: How it was answered.
        tool: Number of the tool that it is about.

    Example:
        >>> from robolink.model import AnsweredBy
        >>> from robolink_cli.prompts.questions import keep_answer
        >>> keep_answer("Write tool 1?", True, AnsweredBy.YES)  # no command runs: for nothing
    """
    from robolink.model import answer_entry

    context = click.get_current_context(silent=True)
    controller = None if context is None else context.meta.get(WATCHED)
    if controller is not None:
        controller.outcomes.answered(answer_entry(question, answer, by, tool=tool))


def asked_for_text(question: str) -> str:
    """Ask for a line of text.

    Raises:
        DeclinedError: None was typed, or ``q``.
    """
    from robolink.model import AnsweredBy
    from robolink.runner import Question
    from robolink_cli.prompts.operator import terminal

    terminal().ask(question, Question.TEXT)
    text = _answer().strip()
    if text in ("", "q"):
        raise DeclinedError(tr("No answer was given."), remedy=tr("Nothing was sent."))
    keep_answer(question, text, AnsweredBy.PERSON)
    return text


def _answer() -> str:
    """Return the next line; read the controller's status meanwhile, if one is connected."""
    from robolink.runner import awaited_line
    from robolink_cli.prompts.operator import terminal

    controller = click.get_current_context().meta.get(WATCHED)
    return awaited_line(terminal(), (lambda: None) if controller is None else controller.status)


def require_yes(question: str) -> None:
    """Ask for a yes.

    Raises:
        DeclinedError: The answer was no.
    """
    if not asked(question):
        raise DeclinedError(not_yes(), remedy=tr("Nothing was sent."))


def not_yes() -> str:
    """Return that the answer was no: on a page it was pressed, on a terminal anything but y."""
    return tr("You answered no.") if person_here() is Person.WIRE else tr("That was not y.")


_POSITIVE: Final = NumberInside(min=0, min_open=True)

AcceptedLength = Annotated[
    float | None,
    _POSITIVE,
    CliOption(
        "--accept-jump",
        help="Accept a change up to MM this time, beyond the cell's limit; for engineers.",
    ),
]

AcceptedAngle = Annotated[
    float | None,
    _POSITIVE,
    CliOption(
        "--accept-turn",
        help="Accept a turn up to DEG this time, beyond the cell's limit; for engineers.",
    ),
]


@contextmanager
def accepted_jump(
    controller: "Controller",
    tool: int,
    jump: "Jump",
    *,
    accepted_mm: float | None,
    accepted_deg: float | None,
) -> Iterator[None]:
    """Let a permitted person accept a jump beyond the cell's limits, for the block.

    ``--yes`` does not answer this question: it was typed before the figure was known.

    Args:
        controller: The controller, connected.
        tool: Number of the tool.
        jump: How far its tip would be taken.
        accepted_mm: The length that was accepted in advance.
        accepted_deg: The angle that was accepted in advance.

    Raises:
        NotAllowedError: It takes an engineer; nobody was asked.
        DeclinedError: The answer was no, or nobody could be asked.
    """
    from robolink.model import PersonRole

    guard = controller.change_guard
    allowed = guard.limits
    # A person without the right is refused, not asked.
    if controller.outcomes.signature.role != PersonRole.OPERATOR and jump.exceeds(
        accepted_mm or allowed.length_mm, accepted_deg or allowed.angle_deg
    ):
        _ask(allowed.figure(tool, jump), allowed.findings(tool, jump))
    with guard.accepting(tool, jump):
        yield


def _ask(figure: str, findings: str) -> None:
    if json_is_on() or not person_here():
        raise DeclinedError(
            findings,
            remedy=tr(
                "Nothing was written. Check sign and unit. An engineer may write it on a "
                "terminal, or with --accept-jump and --accept-turn."
            ),
        )
    if not asked(tr("{figure} Write it anyway? Check sign and unit first.", figure=figure)):
        raise DeclinedError(not_yes(), remedy=tr("Nothing was written."))
