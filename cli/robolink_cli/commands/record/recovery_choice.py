"""The page of a recovery: what happened, what is read, and which needle is mounted."""

from typing import Final

from robolink.messages import tr
from robolink.model import Controller, Finding, MarkerKind, Verdict, begun_in_words
from robolink.timing import local_label
from robolink.transaction import look
from robolink_cli.prompts.present import present_desk
from robolink_cli.wizard.choices import ChoiceSubject, choose

OLD: Final = "old"
NEW: Final = "new"
BLOCKED: Final = "blocked"


def chosen_at_desk(controller: Controller) -> str | None:
    """Have the person at the desk choose, where reading alone decides nothing.

    Returns ``old``, ``new`` or ``blocked``; ``None`` where nobody is to be asked, or nothing that
    is open takes a person. A recovery is then what reading makes of it.

    Raises:
        DeclinedError: The person leaves; everything stays as it is.
    """
    from robolink.calibration_run import open_turn_tests, untested_sentences

    desk = present_desk()
    if desk is None:
        return None
    findings = look(controller)
    written = [one for one in findings if _is_untested_write(one)]
    if not written and not any(one.verdict.needs_a_person for one in findings):
        return None
    answers = (OLD, NEW, BLOCKED) if written else (OLD, BLOCKED)
    subject = ChoiceSubject(
        tr("Recover"),
        (
            *(row for one in findings for row in _rows(one)),
            *untested_sentences(controller),
            *_selected(controller),
        ),
        tuple(
            _option(answer, written=bool(written), tests=bool(open_turn_tests(controller)))
            for answer in answers
        ),
        marked=None,
        does=tr("Do it"),
        leaves=tr("Leave it blocked"),
        enters=False,
    )
    question = (
        tr("Look at the robot: which needle is mounted?")
        if written
        else tr("Look at the robot: is all as it should be?")
    )
    return answers[choose(desk, question, subject, controller.status)]


def _is_untested_write(finding: Finding) -> bool:
    return finding.marker.kind is MarkerKind.CHANGE and finding.verdict in (
        Verdict.NOT_FINISHED,
        Verdict.CONFLICT,
    )


def _rows(finding: Finding) -> list[str]:
    return [
        tr(
            "What happened: {when}  {request}",
            when=local_label(finding.marker.begun_at),
            request=begun_in_words(finding.marker),
        ),
        tr("What we read: {sentence}", sentence=finding.sentence),
    ]


def _selected(controller: Controller) -> list[str]:
    selected = controller.tools.selected()
    return [] if selected is None else [tr("Tool {t} is selected.", t=selected)]


def _option(answer: str, *, written: bool, tests: bool) -> str:
    if answer == BLOCKED:
        return tr("I cannot tell. Stay blocked; call an engineer.")
    if not written:
        return tr("All is as it should be. Work may go on.")
    if answer == OLD:
        return tr("The old one. Put the old value back.")
    if tests:
        return tr("The new one. Make the turn test, then keep the new value.")
    return tr("The new one. Keep the new value; nobody has tested it.")
