"""What is told of a run of a recipe while it goes on: events to a script, headings to a person."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import click

from robolink.calibration import VerifyResult
from robolink.calibration_run import Listener, Moment, Proposal
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import ToolReceipt
from robolink.procedures import MeasurementContext
from robolink.runner import Ask, Confirm, Notify, StepDone, TakenStep
from robolink_cli.console.exit_codes import error_body, exit_code
from robolink_cli.console.output import drawn_elsewhere, hand_over
from robolink_cli.console.render import note, switch_json_on
from robolink_cli.views.documents import (
    pose_payload,
    proposal_payload,
    receipt_payload,
    verification_payload,
)


class EventStream:
    """Writes one JSON line for each event, if requested.

    Args:
        context: Click's, so that text for people goes to stderr.
        on: Whether it is wanted.
    """

    def __init__(self, context: click.Context, *, on: bool) -> None:
        self.on = on
        if on:
            switch_json_on(context)

    def emit(self, event: str, **payload: object) -> None:
        """Write one event."""
        if self.on:
            line = {"schema": "robolink/recalibration-event/1", "event": event, **payload}
            hand_over(json.dumps(line, allow_nan=False))

    @contextmanager
    def closing(self) -> Iterator[None]:
        """End the stream with ``error`` when the block does; ``result`` is the block's own."""
        try:
            yield
        except (Exception, KeyboardInterrupt) as error:
            self.emit("error", error=error_body(error), exit_code=exit_code(error))
            raise


class Progress(Listener):
    """Reports the events to a person and a script.

    Attributes:
        tool: Number of the tool at work.

    Args:
        events: The stream of a script.
        tools: How many tools the recipe has.
    """

    def __init__(self, events: EventStream, tools: int) -> None:
        self._events, self._tools = events, tools
        self.tool = 0

    def moment(self, moment: Moment, bench: MeasurementContext, tool: int | None = None) -> None:  # noqa: ARG002 - a phase is a phase
        """Show which phase begins."""
        if tool is not None:
            self.tool = tool
        if not drawn_elsewhere():
            heading = _heading(moment, self.tool)
        elif self._tools > 1 and moment is Moment.BEFORE_MEASURE:
            heading = tr("Measuring tool {tool}.", tool=self.tool)
        else:
            heading = ""  # the screen has a heading
        if heading:
            note(heading)
        self._events.emit("phase", phase=moment, tool=tool)

    def step(self, tool: int, done: StepDone) -> None:
        """Report one step."""
        self.tool = tool
        kind, text = _in_words(done.step)
        pose = pose_payload(done.pose) if done.pose else None
        self._events.emit("step", tool=tool, kind=kind, text=text, pose=pose)

    def refused(self, tool: int, error: CalibrationError, *, again: bool) -> None:
        """Report a measurement that is not believed."""
        if again:
            note(tr("Tool {tool}: {error} Measuring it again.", tool=tool, error=error))
        self._events.emit(
            "refused", tool=tool, code=error.code, what=error.what, remedy=error.remedy, again=again
        )

    def proposed(self, proposals: Sequence[Proposal]) -> None:
        """Show the measured value next to the stored one."""
        from robolink_cli.views.fit import show_proposal

        for proposal in proposals:
            show_proposal(proposal)
            self._events.emit("proposal", **proposal_payload(proposal))

    def wrote(self, receipt: ToolReceipt) -> None:
        """Report a write."""
        from robolink_cli.views.fit import tell_written

        tell_written(receipt)
        self.tool = receipt.tool
        self._events.emit("write", **receipt_payload(receipt))

    def verified(self, tool: int, result: VerifyResult) -> None:
        """Report a turn test."""
        self._events.emit("verification", tool=tool, **(verification_payload(result) or {}))

    def told(self, sentence: str) -> None:
        """Pass on a message to the person."""
        self._events.emit("note", text=sentence)


def _in_words(step: TakenStep) -> tuple[str, str]:
    """Return what kind of step it is, and what it says."""
    match step:
        case Ask():
            return "touch", step.instruction
        case Notify():
            return "remark", step.text
        case Confirm():
            return "offer", step.question
        case _:
            return "move", step.purpose


def _heading(moment: Moment, tool: int) -> str:
    """Return the heading of what comes next, empty for none."""
    if moment is Moment.BEFORE_MEASURE:
        return tr("-- tool {tool}: measure", tool=tool)
    if moment is Moment.BEFORE_WRITE:
        return tr("-- propose and write")
    return tr("-- done") if moment is Moment.END else ""
