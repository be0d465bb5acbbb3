"""How the work ended: what the last screen says, and what stays of it."""

from robolink.calibration import (
    proved_statements,
    turn_test_headline,
    turn_test_sentences,
)
from robolink.calibration_run import ChangeReport, ToolReport, next_steps
from robolink.controller_outcome import UNTOUCHED, outcome_after
from robolink.errors import (
    CalibrationError,
    DeclinedError,
    OutcomeUnknownError,
    RobolinkError,
    VerifyError,
)
from robolink.messages import tr
from robolink.model import PersonRole, describe_offset, describe_outcome
from robolink_cli.access.warnings import way_back
from robolink_cli.console.exit_codes import next_of, was_refused
from robolink_cli.console.render import next_lines
from robolink_cli.wizard.state import CheckSubject, ChoiceSubject, LastScreen, WizardState
from robolink_cli.wizard.views.place import touch_title


def done_lines(state: WizardState, report: ChangeReport) -> list[str]:
    """Return the results."""
    needle = state.header.needle
    lines = [line for one in report.tools for line in _tool_lines(one, needle)]
    record = tr(
        'Record: change {id}. To read it: robolink -c "{cell}" journal report {id}',
        cell=state.header.cell,
        id=report.change[:8],
    )
    lines.append(record)
    if any(one.receipt is not None for one in report.tools):
        if report.role != PersonRole.OPERATOR:
            back = tr(
                'To undo it: robolink -c "{cell}" undo {id}',
                cell=state.header.cell,
                id=report.change[:8],
            )
            lines.append(back)
        lines.append(tr("Run the first part slowly and watch it."))
    for one in report.tools:
        if one.receipt is not None:
            steps = next_steps(one.proposal.result, one.proposal.tool)
            lines += next_lines(steps, state.header.cell)
    return lines


def _tool_lines(report: ToolReport, needle: str) -> list[str]:
    proposal, proof = report.proposal, report.verification
    if report.receipt is None:
        return [tr("Tool {t} is measured. Nothing was written.", t=proposal.tool)]
    value = describe_offset(proposal.offset)
    tested = proof is not None and (proof.judgement is None or proof.judgement.good)
    if proof is None:
        said = tr("Tool {t} is measured and written, not tested.", t=proposal.tool)
    elif not tested:
        said = tr("Tool {t} is measured and written; its turn test left a doubt.", t=proposal.tool)
    elif needle:
        said = tr(
            "Needle {id} on tool {t} is measured, written and tested.", id=needle, t=proposal.tool
        )
    else:
        said = tr("Tool {t} is measured, written and tested.", t=proposal.tool)
    lines = [said, tr("On the controller: tool {t} = {value}", t=proposal.tool, value=value)]
    lines += proved_statements(proposal.result, proof)
    if proof is not None:
        lines.append(turn_test_headline(proof))
        lines += turn_test_sentences(proof.judgement, proposal.result)
    return lines


def ended_of(state: WizardState, error: BaseException | None, at_s: float) -> LastScreen | None:
    """Return the last screen; ``None`` for an end that is shown in lines alone.

    Args:
        state: The last one.
        error: What ended the work, ``None`` where it was carried out.
        at_s: When.
    """
    if error is None:
        if state.report is None:
            return None
        lines = [*done_lines(state, state.report), *state.closing]
        done = tr("DONE")
        return LastScreen(True, tuple(lines), (_head(state, done), *lines), at_s, done)
    begun = state.subject is not None
    left = isinstance(error, DeclinedError) and isinstance(
        state.subject, (ChoiceSubject, CheckSubject)
    )
    if not begun or left or state.free_jog is not None or not isinstance(error, RobolinkError):
        return None
    headed = headed_of(state, error)
    kept = (_head(state, headed), *_where(state), *_next(state, error), *state.closing)
    said = (*stopped_lines(state, error), *state.closing)
    blocked = is_blocked(error)
    return LastScreen(False, said, kept, at_s, headed, again=not blocked, blocked=blocked)


def stopped_lines(state: WizardState, error: RobolinkError) -> list[str]:
    """Return why it ended, where, what stands on the controller, and the next command."""
    outcome = outcome_after(error)
    blocked = is_blocked(error)
    stands = "" if outcome is UNTOUCHED else describe_outcome(outcome, settles=not blocked)
    # The sentence about the outcome already says that nothing was written.
    remedy = "" if error.remedy in stands else error.remedy
    typed = state.header.command.split()
    texts = (next_of(one, error, outcome, typed) for one in (error.what, remedy, stands))
    said = [one for one in texts if one]
    return [*_where(state), *said, "", *_next(state, error)]


def kept_lines(state: WizardState, error: BaseException | None) -> list[str]:
    """Return what stays on the terminal when no last screen was shown."""
    if error is None or state.subject is None:
        return [*state.closing]
    return [_head(state, headed_of(state, error)), *_where(state), *state.closing]


def _head(state: WizardState, ended: str) -> str:
    return f"{state.header.cell}   {state.header.job}   {ended}"


def headed_of(state: WizardState, error: BaseException) -> str:
    """Return whether a job was stopped, or was refused before anything happened."""
    measured = state.touch is not None or isinstance(error, (CalibrationError, VerifyError))
    if was_refused(error) and not measured and outcome_after(error).untouched:
        return tr("NOT STARTED")
    return tr("STOPPED")


def is_blocked(error: RobolinkError) -> bool:
    """Return whether the robot accepts only ``recover``, and what comes before it."""
    return outcome_after(error).left_open or isinstance(error, OutcomeUnknownError)


def _where(state: WizardState) -> list[str]:
    touch = state.touch
    if touch is None or not touch.number:
        return []
    return [tr("It ended here: {touch}.", touch=touch_title(touch))]


def _next(state: WizardState, error: RobolinkError) -> list[str]:
    """Return how to continue, if known; a blocked robot accepts nothing else.

    What was refused would be refused again, so it is proposed only where a person, or what was
    measured, ended it.
    """
    outcome = outcome_after(error)
    if is_blocked(error):
        back = way_back(state.header.cell, reset_first=outcome.reset_first)
        line = tr("Next: {command}", command=back)
        return [next_of(line, error, outcome, state.header.command.split())]
    if isinstance(error, VerifyError) and error.next_commands:
        return [
            tr("Next: {command}", command=f'robolink -c "{state.header.cell}" {command}')
            for command in error.next_commands
        ]
    measured = isinstance(error, (CalibrationError, VerifyError)) and state.touch is not None
    command = state.header.command
    if not command or (was_refused(error) and not measured):
        return []
    return [tr("Next: {command}", command=command)]
