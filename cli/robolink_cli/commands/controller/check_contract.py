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
    """What is to be checked besides what can be read.

    Attributes:
        tool: The tool that may be written; ``None`` for none.
        step_mm: How far the robot may go up; ``None`` for nowhere.
        yes: Whether a person agreed beforehand.
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
            help="Also hold it to the promises about writing: with --tool, and after a yes.",
        ),
    ] = False,
    tool: Annotated[
        int | None,
        click.IntRange(min=1),
        CliOption(
            metavar="NUMBER", help="The tool that --write may change; one that no program uses."
        ),
    ] = None,
    moves: Annotated[
        bool,
        CliOption(
            "--move",
            help="Also hold it to the promises about movement: small steps up, after a yes.",
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
            help="Check a driver of your own: what this is called for gives a controller.",
        ),
    ] = None,
    junit: Annotated[
        Path | None, CliOption(help="Also write the findings as JUnit XML, for pipelines.")
    ] = None,
    yes: Yes = False,
) -> int:
    """Hold a controller to what every kind of controller promises; without options, reading only.

    With --write it writes one tool several times, selects it and the flange, stops and resets;
    with --move it goes up and down in small steps. Tool, selection, power and speed come back, and
    stay on record until they are back: where this is killed, 'robolink recover' brings them back.
    Ends with 1 where a promise is broken; what a controller refuses to show in its present state is
    an error, as elsewhere.
    """
    if (writes and tool is None) or (tool is not None and not writes):
        raise click.UsageError(tr("--write and --tool go together: say which tool may change."))
    asked = _Asked(tool, step_mm if moves else None, yes)
    if junit is not None and not junit.parent.is_dir():
        raise click.UsageError(tr("There is no folder {path}.", path=junit.parent))
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
    """Give the result of checks that were all made."""
    found, broken = report.found, report.broken

    def show() -> None:
        rows = [
            (one.name.replace("_", " "), one.broken or tr("kept"))
            for one in sorted(found, key=lambda one: not one.broken)
        ]
        table(tr("what {who} promises", who=report.identity), (tr("promise"), tr("found")), rows)
        say(
            tr("{count} of {all} promises are broken.", count=len(broken), all=len(found))
            if broken
            else tr("All {all} promises that were looked at are kept.", all=len(found))
        )

    checks = [
        {"name": one.name, "promise": one.promise, "broken": one.broken or None} for one in found
    ]
    emit("contract", {"controller": report.identity, "kept": not broken, "checks": checks}, show)


def _of_a_cell(context: CliContext, asked: _Asked, report: "ContractReport") -> None:
    """Check a controller of a cell; what was there stands on its record meanwhile."""
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
                    tr("checks of the contract"),
                    tool=asked.tool,
                    agree=lambda controller: _agree(controller, asked),
                    trials=trials.ledgers,
                )
            )
        stack.callback(trials.close)
        _examine(trials.connect, asked, report, _looked_at(trials.connect, asked, report))


def _of_a_driver(driver: str, asked: _Asked, report: "ContractReport") -> None:
    """Check what somebody's own function gives; only the checks put back what they change."""
    from robolink_cli.commands.controller.contract_report import driver_named, told_of_the_driver

    made = driver_named(driver)
    with told_of_the_driver(driver):
        if asked.changes:
            with made() as controller:
                _agree(controller, asked)
        tool = _looked_at(made, asked, report)
    _examine(made, asked, report, tool)


def _looked_at(connect: "Callable[[], Controller]", asked: _Asked, report: "ContractReport") -> int:
    """Note who it is; return which tool is looked at.

    Raises:
        ConfigError: It cannot do what was asked for.
    """
    with connect() as controller:
        able, tool = controller.capabilities, asked.tool or min(controller.tools.indices())
        for wanted, can in ((asked.tool, able.tool_write), (asked.step_mm, able.motion)):
            if wanted is not None and not can:
                raise ConfigError(
                    tr("This controller cannot be held to that: it is not able to do it."),
                    remedy=tr("Leave --write or --move out."),
                )
        report.identity = str(controller.outcomes.identity)
        return tool


def _checks(asked: _Asked) -> "Sequence[Check]":
    """Return the checks that were asked for."""
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
    """Make the checks that were asked for, and tell of each on the way.

    Raises:
        RobolinkError: A stop, a link that is gone, a state that refuses: nothing more is begun.
    """
    from robolink.testing import Subject, outcomes

    subject = Subject(connect, tool=tool, step_mm=asked.step_mm or 1.0)
    for one in outcomes(subject, _checks(asked)):
        report.found.append(one)
        if asked.changes:
            said = one.broken if one.error is None else one.error.what
            note(f"{one.name.replace('_', ' ')}: {said or tr('kept')}")
        if one.error is not None:
            raise one.error


def _agree(controller: "Controller", asked: _Asked) -> None:
    """Have a person say yes to what will be written and moved.

    Raises:
        DeclinedError: No, or nobody could be asked.
        NotReadyError: Nothing can move now.
    """
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
            "The controller is stopped and reset, which can switch outputs off: a part may "
            "drop. What was there comes back. Start the checks now?"
        )
    )
    if asked.step_mm is not None:
        agree_to_motion(joined(" ", said), yes=asked.yes)
        return
    heed_what_was_left(yes=asked.yes, in_tool=False)
    if not asked.yes:
        if not questions.on_terminal():
            raise DeclinedError(
                tr("A tool would be written for the checks, but there is nobody to ask."),
                remedy=tr("Add --yes when nobody uses the controller, or run it on a terminal."),
            )
        questions.require_yes(joined(" ", said))
