"""recover: the one way to finish or undo an interrupted job."""

from typing import TYPE_CHECKING, Annotated, Final, Literal

import click

from robolink.errors import ConfigError
from robolink.messages import declared, tr
from robolink.model import AnsweredBy, Controller, Finding, MarkerKind, Verdict, begun_in_words
from robolink.timing import local_label
from robolink.transaction import Recovery, look
from robolink_cli.commands.measure.recipe_choice import context_at_desk
from robolink_cli.commands.record.recovery_guide import Guide, show_end
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, json_is_on
from robolink_cli.options.consent import DryRun, Plain, Yes
from robolink_cli.options.declaration import CliOption
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import (
    CliContext,
    controller_options,
    guided_if_alone,
    optional_controller,
)
from robolink_cli.session.take_over import end_holder
from robolink_cli.views.documents import finding_payload
from robolink_cli.wizard.state import ChoiceSubject, choose

if TYPE_CHECKING:
    from robolink.inspection import CellRecovery

OLD: Final = "old"
NEW: Final = "new"
BLOCKED: Final = "blocked"


def chosen_at_desk(controller: Controller) -> str | None:
    """Let the person at the desk choose, where reading alone decides nothing.

    Returns ``old``, ``new`` or ``blocked``; ``None`` where nobody is to be asked, or nothing that
    is open takes a person. A recovery is then what reading makes of it.

    Raises:
        DeclinedError: The person leaves; everything stays as it is.
    """
    from robolink.calibration_run import open_turn_tests, untested_sentences

    desk = current_desk()
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
        else tr("Look at the robot: is everything as it should be?")
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
        return tr("I am not sure. Keep the robot blocked and call an engineer.")
    if not written:
        return tr("Everything is as it should be. Work can continue.")
    if answer == OLD:
        return tr("The old one. Restore the old value.")
    if tests:
        return tr("The new one. Make the turn test, then keep the new value.")
    return tr("The new one. Keep the new value; nobody has tested it.")


@click.command("recover")
@optional_controller
def recover(
    context: CliContext,
    *,
    dry_run: DryRun = False,
    _plain: Plain = False,
    keep: Annotated[
        bool,
        CliOption(
            late=True,
            help="Keep untested new values; without it robolink restores the old ones.",
        ),
    ] = False,
    choose: Annotated[
        Literal["old", "new", "blocked"] | None,
        CliOption(
            late=True,
            help="Your answer to every question: restore the old values; keep the new ones, on "
            "a terminal after their turn test; or leave everything blocked.",
        ),
    ] = None,
    yes: Annotated[
        bool,
        CliOption(
            late=True,
            help="Confirms what robolink cannot read: you have looked at the robot, and "
            "work can continue.",
        ),
    ] = False,
    forget: Annotated[
        bool,
        CliOption(
            late=True,
            help="Drop all unfinished jobs without a check and without restoring values; "
            "you take responsibility.",
        ),
    ] = False,
    take_over: Annotated[
        str | None,
        CliOption(
            late=True,
            metavar="REASON",
            help="Take over this controller from the program that has it locked; also a "
            "PLC's mailbox, where the PLC stops any movement. A program of this computer is "
            "ended: first the robot is stopped and must stand still. One of another computer "
            "is refused from then on. Your name and the reason are recorded.",
        ),
    ] = None,
) -> int:
    """Finish or undo an interrupted job: after a stop, a crash or a lost link.

    Reads the controller first, writes each tool at most once, asks you only what it cannot read.
    Finishes or undoes each tool change, selects the cell's own tool again, and shows how far the
    robot got. Moves nothing, except for a turn test that you choose and confirm on a terminal.
    Questions for a person are asked on a terminal; elsewhere they stay open, with exit code 6,
    unless --yes answers for you. You can run it again at any time.
    """
    if choose is not None and (keep or yes or forget):
        raise ConfigError(
            tr("--choose cannot be combined with --keep, --yes or --forget."),
            remedy=tr("Nothing was sent. Give one of them."),
        )

    def settle() -> tuple[int, dict[str, object]]:
        at = context_at_desk(context, declared("Recover"))
        ended = end_holder(at, take_over) if take_over is not None and not dry_run else None
        with open_controller(at, quiet=True, changes=not dry_run) as controller:
            if take_over is not None and not dry_run:
                controller.take_over(take_over)
                if ended is not None:
                    controller.outcomes.append(ended.entry())
            word = choose or (None if forget else chosen_at_desk(controller))
            guide = Guide(
                controller,
                keep=keep or word == NEW,
                word=yes or word in (OLD, NEW),
                by=AnsweredBy.YES if yes else AnsweredBy.OPTION if choose else None,
                tests=word == NEW and not dry_run and _somebody_there(),
            )
            done: Recovery | CellRecovery
            if word == BLOCKED:
                done, forgotten = guide.left_blocked(declined=choose is None), 0
            else:
                done, forgotten = _gone_through(guide, forget=forget, yes=yes, dry_run=dry_run)
            return guide.exit_code(done), guide.payload(done) | {"forgotten": forgotten}

    alone = not (dry_run or keep or yes or forget or choose)
    code, payload = guided_if_alone(context, settle, job=tr("Recover"), alone=alone)
    emit("recover", payload, lambda: None if dry_run else show_end(payload))
    return code


@click.command(hidden=True)
@controller_options
def resolve(
    context: CliContext,
    *,
    dry_run: DryRun = False,
    yes: Yes = False,
    forget: Annotated[bool, CliOption(late=True, help="As with 'robolink recover'.")] = False,
) -> int:
    """Same as 'robolink recover'; without a terminal, giving the command is your answer."""
    with open_controller(context, quiet=True, changes=not dry_run) as controller:
        by = AnsweredBy.YES if yes else AnsweredBy.COMMAND
        guide = Guide(controller, keep=False, word=yes or not person_here(), by=by)
        done, forgotten = _gone_through(guide, forget=forget, yes=yes, dry_run=dry_run)
        payload = guide.payload(done)
    document: dict[str, object] = {
        "findings": [finding_payload(finding) for finding in (*done.settled, *done.left)],
        "forgotten": forgotten,
        "settled": not dry_run and not done.left,
    }
    emit("resolve", document, lambda: None if dry_run else show_end(payload))
    return 0 if dry_run else guide.exit_code(done)


def _somebody_there() -> bool:
    """Whether a person can agree to movements, and move the tip onto the pin."""
    return current_desk() is not None or (bool(person_here()) and not json_is_on())


def _gone_through(
    guide: Guide, *, forget: bool, yes: bool, dry_run: bool
) -> "tuple[Recovery | CellRecovery, int]":
    """Return what was found and done, and how many markers were removed."""
    if forget:
        return Recovery((), ()), guide.forget(yes=yes, dry_run=dry_run)
    return guide.look() if dry_run else guide.run(), 0
