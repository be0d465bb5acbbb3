"""check-contract: whether a controller keeps what every kind of controller promises."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink.errors import ConfigError, DeclinedError
from robolink.messages import joined, tr
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import emit, note, say, table
from robolink_cli.options.consent import Yes
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import controller_argument
from robolink_cli.session.context import CliContext, controller_options

if TYPE_CHECKING:
    from robolink.model import Controller
    from robolink.testing import Check
    from robolink_cli.commands.controller.contract_report import ContractReport

_SPEED_MM_S: Final = 10.0


@dataclass(frozen=True, slots=True)
class _Asked:
    """What is checked besides what can be read.

    Attributes:
        tool: The tool that may be written; ``None`` for none.
        step_mm: How far the robot may go up; ``None`` for nowhere.
        yes: Whether a person agreed in advance.
    """

    tool: int | None
    step_mm: float | None
    yes: bool

    @property
    def changes(self) -> bool:
        """Whether anything is written or moved."""
        return self.tool is not None or self.step_mm is not None


@click.command("check-contract")
@controller_argument
@controller_options
def check_contract(
    context: CliContext,
    *,
    writes: Annotated[
        bool,
        CliOption(
            "--write",
            help="Also check writing: needs --tool, and asks first.",
        ),
    ] = False,
    tool: Annotated[
        int | None,
        click.IntRange(min=1),
        CliOption(
            metavar="NUMBER",
            help="The tool that --write may change; choose one that no program uses.",
        ),
    ] = None,
    moves: Annotated[
        bool,
        CliOption(
            "--move",
            help="Also check movement: small steps up; asks first.",
        ),
    ] = False,
    step_mm: Annotated[
        float,
        NumberInside(min=0.2, max=5),
        CliOption(help="How far --move goes up, and down again."),
    ] = 1.0,
    driver: Annotated[
        str | None,
        CliOption(
            metavar="MODULE:NAME",
            help="Check your own driver: a class or function that returns a controller.",
        ),
    ] = None,
    junit: Annotated[
        Path | None, CliOption(help="Also write the results as JUnit XML, for CI.")
    ] = None,
    yes: Yes = False,
) -> int:
    """Check that a controller behaves as every controller type must; without options it only reads.

    With --write it writes one tool several times, selects it and the flange, stops and resets;
    with --move it moves up and down in small steps. It restores tool, selection, power and speed.
    If the command is killed before that, 'robolink recover' restores them. Exit code 1 when a check
    fails; if the controller refuses to show something in its present state, that is an error, as
    elsewhere.
    """
    if (writes and tool is None) or (tool is not None and not writes):
        raise click.UsageError(
            tr("--write needs --tool, and the reverse: the tool that may change.")
        )
    asked = _Asked(tool, step_mm if moves else None, yes)
    if junit is not None and not junit.parent.is_dir():
        raise click.UsageError(tr("The folder {path} does not exist.", path=junit.parent))
    from robolink_cli.commands.controller.contract_report import ContractReport

    report = ContractReport(_checks(asked), junit)
    with report.told(on_the_way=asked.changes):
        if driver is not None:
            _of_a_driver(driver, asked, report)
        else:
            _of_a_cell(context, asked, report)
    _show(report)
    return DIFFERENT if report.broken else 0


def _show(report: "ContractReport") -> None:
    """Show the result of checks that were all made."""
    found, broken = report.found, report.broken

    def show() -> None:
        rows = [
            (one.name.replace("_", " "), one.broken or tr("passed"))
            for one in sorted(found, key=lambda one: not one.broken)
        ]
        table(tr("checks of {who}", who=report.identity), (tr("check"), tr("found")), rows)
        say(
            tr("{count} of {all} checks failed.", count=len(broken), all=len(found))
            if broken
            else tr("All {all} checks made have passed.", all=len(found))
        )

    checks = [
        {"name": one.name, "promise": one.promise, "broken": one.broken or None} for one in found
    ]
    emit("contract", {"controller": report.identity, "kept": not broken, "checks": checks}, show)


def _of_a_cell(context: CliContext, asked: _Asked, report: "ContractReport") -> None:
    """Check a controller of a cell; its record holds the earlier state meanwhile."""
    from robolink.testing import kept_on_site
    from robolink_cli.commands.controller.contract_report import TrialConnections
    from robolink_cli.session.connection import open_controller

    trials = TrialConnections(context)
    with ExitStack() as stack:
        if asked.changes:
            stack.enter_context(
                kept_on_site(
                    lambda *, leaves: open_controller(
                        context, quiet=True, changes=True, leaves=leaves
                    ),
                    tr("contract checks"),
                    tool=asked.tool,
                    agree=lambda controller: _agree(controller, asked),
                    trials=trials.ledgers,
                )
            )
        stack.callback(trials.close)
        _examine(trials.connect, asked, report, _looked_at(trials.connect, asked, report))


def _of_a_driver(driver: str, asked: _Asked, report: "ContractReport") -> None:
    """Check the result of a user's function; only the checks restore what they change."""
    from robolink_cli.commands.controller.contract_report import driver_named, told_of_the_driver

    made = driver_named(driver)
    with told_of_the_driver(driver):
        if asked.changes:
            with made() as controller:
                _agree(controller, asked)
        tool = _looked_at(made, asked, report)
    _examine(made, asked, report, tool)


def _looked_at(connect: "Callable[[], Controller]", asked: _Asked, report: "ContractReport") -> int:
    """Note which controller it is; return which tool is checked.

    Raises:
        ConfigError: It cannot do what was asked for.
    """
    with connect() as controller:
        able, tool = controller.capabilities, asked.tool or min(controller.tools.indices())
        for wanted, can in ((asked.tool, able.tool_write), (asked.step_mm, able.motion)):
            if wanted is not None and not can:
                raise ConfigError(
                    tr("This controller cannot be checked for that: it cannot do it."),
                    remedy=tr("Leave out --write or --move."),
                )
        report.identity = str(controller.outcomes.identity)
        return tool


def _checks(asked: _Asked) -> "Sequence[Check]":
    """Return the requested checks."""
    from robolink.testing import (
        MOVING_CHECKS,
        READING_CHECKS,
        WRITING_CHECKS,
        WRITING_WHILE_MOVING_CHECKS,
    )

    checks = READING_CHECKS
    if asked.tool is not None:
        checks = (*checks, *WRITING_CHECKS)
    if asked.step_mm is not None:
        checks = (*checks, *MOVING_CHECKS)
    if asked.tool is not None and asked.step_mm is not None:
        checks = (*checks, *WRITING_WHILE_MOVING_CHECKS)
    return checks


def _examine(
    connect: "Callable[[], Controller]", asked: _Asked, report: "ContractReport", tool: int
) -> None:
    """Make the requested checks, and report each.

    Raises:
        RobolinkError: A stop, a link that is gone, a state that refuses: nothing more is begun.
    """
    from robolink.testing import Subject, outcomes

    subject = Subject(connect, tool=tool, step_mm=asked.step_mm or 1.0)
    for one in outcomes(subject, _checks(asked)):
        report.found.append(one)
        if asked.changes:
            said = one.broken if one.error is None else one.error.what
            note(f"{one.name.replace('_', ' ')}: {said or tr('passed')}")
        if one.error is not None:
            raise one.error


def _agree(controller: "Controller", asked: _Asked) -> None:
    """Let a person agree to what will be written and moved.

    Raises:
        DeclinedError: No, or nobody could be asked.
        NotReadyError: Nothing can move now.
    """
    from robolink_cli.console.person import person_here
    from robolink_cli.prompts import questions
    from robolink_cli.session.motion_consent import (
        agree_to_motion,
        heed_what_was_left,
        motion_question,
    )

    said = []
    if asked.step_mm is not None:
        purpose, box_mm = tr("for the checks"), 2 * asked.step_mm
        said.append(motion_question(controller, purpose, speed_mm_s=_SPEED_MM_S, box_mm=box_mm))
    if asked.tool is not None:
        said.append(tr("Tool {tool} is written several times and selected.", tool=asked.tool))
    said.append(
        tr(
            "The checks stop and reset the controller, which can switch outputs off: a "
            "part may drop. They restore the tool. Start them now?"
        )
    )
    if asked.step_mm is not None:
        agree_to_motion(joined(" ", said), yes=asked.yes)
        return
    heed_what_was_left(yes=asked.yes, in_tool=False)
    if not asked.yes:
        if not person_here():
            raise DeclinedError(
                tr("A tool would be written for the checks, but there is nobody to ask."),
                remedy=tr("Add --yes when nobody uses the controller, or run it on a terminal."),
            )
        questions.require_yes(joined(" ", said))
