"""What a measurement is repeatable to and accurate to, in words and as tables."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from robolink.calibration import (
    Accuracy,
    CalibrationResult,
    RowInWords,
    chain_of,
    known_doubts,
    measured_axes,
    order_in_words,
    proved_statements,
    rows_in_words,
    stated_mm,
    statement_sentences,
    turn_test_headline,
    turn_test_sentences,
)
from robolink.calibration_run import (
    LimitVerdict,
    PlannedStep,
    Proposal,
    ToolReport,
    next_steps,
)
from robolink.messages import tr
from robolink.methods import NextStep
from robolink.model import (
    Controller,
    ToolOffset,
    ToolReceipt,
    describe_offset,
    json_fields,
    json_value,
)
from robolink.runner import TeachPrompt
from robolink_cli.console.render import next_lines, note, say, table
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.views.documents import (
    number,
    pose_payload,
    proposal_payload,
    receipt_payload,
    show_change,
    verification_payload,
)


def steps_payload(controller: Controller, steps: Sequence[PlannedStep]) -> list[dict[str, object]]:
    """Return previewed steps with their requests and limit checks."""
    group = controller.groups[0]
    return [
        {
            "text": step.text,
            "target": pose_payload(step.target) if step.target else None,
            "requests": list(step.requests(group)),
            "refusal": step.refusal,
        }
        for step in steps
    ]


def remarks(result: CalibrationResult) -> Iterator[str]:
    """Yield the remarks about a measurement besides its numbers, a sentence each."""
    for said in (_fit, _order):
        yield from filter(None, (said(result),))
    yield from statement_sentences(result)
    for said in (_each_axis, _change, _ways, _needle, _camera, _runout, _chain):
        yield from filter(None, (said(result),))
    yield from known_doubts(note for note in result.notes if note not in _SAID_OTHERWISE)


_SAID_OTHERWISE: Final = ("length_not_observable",)
"""Notes that are left out, because the proposal gives their reason in a separate sentence."""


def _fit(result: CalibrationResult) -> str:
    """Return how well the poses agree, in one sentence; empty if a statement says why not."""
    if result.rms_mm is None:
        if result.repeatable_to_mm is None and measured_axes(result):
            return ""
        if result.method == "one-touch":
            return tr("One touch cannot be checked.")
        if result.method == "two-pose":
            return tr("Two touches cannot check each other.")
        return tr("No measurement is left over to check it.")
    return tr(
        "The {count} touches agree within {rms:.3f} mm; the worst is {largest:.3f} mm off.",
        count=len(result.residuals_mm) - len(result.rejected),
        rms=result.rms_mm,
        largest=result.max_residual_mm,
    )


def _order(result: CalibrationResult) -> str:
    """Return what moved while the poses were taken, and how far; empty if nothing did."""
    order = result.evidence.run_order if result.evidence is not None else None
    return order_in_words(order) if order is not None else ""


def _each_axis(result: CalibrationResult) -> str:
    """Return the 95 % interval of each measured component alone; empty if unknown."""
    if len(result.half_width95) < 2:
        return ""
    parts = (
        f"{name[0].upper()} +-{stated_mm(half)}"
        for name, half in zip(result.measured, result.half_width95, strict=True)
    )
    if result.interval_from == "resolution":
        basis = tr("from the step of the positions")
    elif result.sigma_stated and result.interval_from != "residuals":
        basis = tr("from what was stated")
    else:
        basis = tr("from how well they agree")
    return tr(
        "Each axis alone is repeatable to: {parts}, {basis}.",
        parts="  ".join(parts),
        basis=basis,
    )


def _change(result: CalibrationResult) -> str:
    """Return the change of Z, and what is known of Z itself; empty for other methods."""
    details = result.details()
    by_mm, half_mm = details.get("change_z_mm"), details.get("change_z_half95_mm")
    stored = details.get("stored_z")
    if not isinstance(by_mm, float) or not isinstance(half_mm, float):
        return ""
    told = tr("change of Z (95 %): {by:+.3f} +-{half:.3f} mm", by=by_mm, half=half_mm)
    if "z_mm" in result.changed or not isinstance(stored, dict):
        return told
    return tr(
        "{told}; the stored Z was measured: journal entry {number}",
        told=told,
        number=stored["entry"],
    )


def _ways(result: CalibrationResult) -> str:
    """Return the angle between the moves along a tool's axes; empty for other methods."""
    off_deg = result.details().get("off_square_deg")
    if not isinstance(off_deg, float):
        return ""
    return tr("The moves are {off:.2f} degrees off a right angle.", off=abs(off_deg))


def _needle(result: CalibrationResult) -> str:
    """Return how a needle leans, and the effect; empty if no digit shows it."""
    if "needle" not in result.details():
        return ""
    from robolink.calibration import BeamsResult  # numpy, loaded by then

    if not isinstance(result, BeamsResult) or result.lean is None:
        return ""
    dx_mm, dy_mm = result.lean.corrected_mm
    return tr(
        "the needle leans by {lean:.2f} degrees: its end is X {dx:+.3f} Y {dy:+.3f} mm from where "
        "the beams saw its shaft",
        lean=result.lean.angle_deg,
        dx=dx_mm,
        dy=dy_mm,
    )


def _camera(result: CalibrationResult) -> str:
    """Return what a measurement says about its camera; empty for nothing."""
    if not result.details():
        return ""
    from robolink.calibration import CameraCalibration, CameraRound  # numpy, loaded by then

    if isinstance(result, CameraRound) and result.camera_error_mm is not None:
        dx_mm, dy_mm = result.camera_error_mm
        return tr(
            "the camera sees everything X {dx:+.3f} Y {dy:+.3f} mm off",
            dx=dx_mm,
            dy=dy_mm,
        )
    if isinstance(result, CameraCalibration):
        camera = result.camera
        x, y = (1000 * scale for scale in camera.scale_mm_per_px)
        mirror = tr("mirrored") if camera.mirrored else tr("not mirrored")
        return tr(
            "camera: {x:.2f} x {y:.2f} micrometres per pixel, turned by {turn:.2f} degrees, "
            "{mirror}, shear {shear:.2f} degrees",
            x=x,
            y=y,
            turn=camera.turn_deg,
            mirror=mirror,
            shear=camera.shear_deg,
        )
    return ""


def _runout(result: CalibrationResult) -> str:
    """Return how far a tip wobbles; empty for other methods."""
    if "runout_table" not in result.details():
        return ""
    from robolink.calibration import RunoutTableResult  # numpy, loaded by then

    if not isinstance(result, RunoutTableResult):
        return ""
    rows = len(result.table.rows)
    told = tr("the tip wobbles") if result.wobble else tr("no wobble larger than the scatter")
    return tr(
        "{told}: it is at most {peak:.3f} mm from where X and Y put it, at {rows} angles",
        told=told,
        peak=result.table.peak_mm,
        rows=rows,
    )


def _chain(result: CalibrationResult) -> str:
    """Return the place of this difference in its chain; empty for other methods."""
    chain = chain_of(result)
    if chain is None:
        return ""
    return tr("difference {count} since the last full calibration", count=chain.changes)


def show_residuals(result: CalibrationResult) -> None:
    """Show the residual of every pose."""
    rows, names = [], ["u_deg"]
    if any(pose.v_deg or pose.w_deg for pose in result.inputs):
        names += ["v_deg", "w_deg"]
    for index, residual in enumerate(result.residuals_mm):
        pose = result.inputs[index] if index < len(result.inputs) else None
        # A single component is a height.
        parts = (0.0, 0.0, *residual) if len(residual) == 1 else (*residual, 0.0)[:3]
        rows.append(
            [
                str(index + 1),
                *(number(getattr(pose, name, None)) for name in names),
                *map(number, parts),
                number(result.residual_distances_mm[index]),
                tr("left out") if index in result.rejected else "",
            ]
        )
    angles = (f"{name[0].upper()} deg" for name in names)
    columns = (tr("pose"), *angles, "dX mm", "dY mm", "dZ mm", tr("distance mm"), "")
    table(tr("How well it fits"), columns, rows)


def show_accuracy_rows(accuracy: Accuracy) -> None:
    """Show the parts of the accuracy statement, a row each, the largest first."""
    columns = (tr("row"), tr("half width"), tr("known from"), tr("share %"))
    rows = [
        [row.title, f"+-{row.half_width}" if row.half_width else "", row.basis, _share(row)]
        for row in rows_in_words(accuracy)
    ]
    table(tr("What it is accurate to, row by row"), columns, rows)


def _share(row: RowInWords) -> str:
    return f"{row.share_percent:.0f}"


def show_proposal(proposal: Proposal) -> None:
    """Show measured and stored values, the accuracy, and the doubts."""
    show_change(
        proposal.tool,
        proposal.before,
        proposal.offset,
        after_name=tr("measured") if proposal.measured is None else tr("proposed"),
        unmeasured=proposal.kept,
    )
    result = proposal.result
    for remark in (*proposal.notes, *remarks(result)):
        say(f"  {remark}")
    if proposal.seating is not None:
        say(f"  {proposal.seating.sentence}")
    if result.residuals_mm:
        show_residuals(result)
    if result.accuracy is not None:
        show_accuracy_rows(result.accuracy)
    for sentence in known_doubts(result.warnings):
        say(f"  ! {sentence}")


def tell_written(receipt: ToolReceipt) -> None:
    """Show a guided person what the controller reads back, before the turn test."""
    if current_desk() is None:
        return
    value = describe_offset(receipt.read_back or ToolOffset())
    told = tr(
        "Written. The controller now has tool {tool} = {value}.", tool=receipt.tool, value=value
    )
    note(told)


def show_verdicts(verdicts: Sequence[LimitVerdict]) -> None:
    """Show what the limits say about a proposal."""
    for verdict in verdicts:
        mark = tr("ok") if verdict.passed else tr("too much")
        say(
            tr(
                "  {name}: {found:.3f} mm, limit {limit:.3f} mm: {mark}",
                name=verdict.name,
                found=verdict.found_mm,
                limit=verdict.limit_mm,
                mark=mark,
            )
        )


def show_report(report: ToolReport) -> None:
    """Show what was written and how the turn test ended."""
    tool, receipt = report.proposal.tool, report.receipt
    if receipt is None:
        return
    if receipt.skipped:
        say(tr("Tool {tool} has this value already. Nothing was written.", tool=tool))
    else:
        say(tr("Written. The controller has stored tool {tool}.", tool=tool))
    if report.verification is None:
        say(tr("Not tested yet."))
    else:
        for drift in report.verification.drifts:
            say(
                tr(
                    "  at U {u:.1f}: {distance:.3f} mm off",
                    u=drift.u_deg,
                    distance=drift.distance_mm,
                )
            )
        say(turn_test_headline(report.verification))
        for sentence in turn_test_sentences(report.verification.judgement, report.proposal.result):
            say(f"  {sentence}")
        for sentence in proved_statements(report.proposal.result, report.verification):
            say(sentence)
    for line in next_lines(_steps(report)):
        say(line)


def judged_payload(proposal: Proposal, verdicts: Sequence[LimitVerdict]) -> dict[str, object]:
    """Return a proposal with what the limits say about it."""
    said = ("code", "found_mm", "limit_mm", "passed")
    judged = [json_fields(verdict, *said) for verdict in verdicts]
    return {**proposal_payload(proposal), "verdicts": judged}


def report_payload(report: ToolReport) -> dict[str, object]:
    """Return the document of a finished calibration."""
    return {
        **judged_payload(report.proposal, report.verdicts),
        "write": receipt_payload(report.receipt) if report.receipt else None,
        "verification": verification_payload(report.verification),
        **_following(report),
    }


def _steps(report: ToolReport) -> tuple[NextStep, ...]:
    """Return what a person does next with a tool that was written."""
    return next_steps(report.proposal.result, report.proposal.tool) if report.receipt else ()


def _following(report: ToolReport) -> dict[str, object]:
    steps = _steps(report)
    return {"next_steps": json_value(steps)} if steps else {}


def show_course(steps: Sequence[PlannedStep]) -> None:
    """Show the course of a measurement, before anybody is asked."""
    moves = sum(step.target is not None for step in steps)
    asks = sum(step.shown is TeachPrompt.PIN for step in steps)
    ways = sum(step.shown in (TeachPrompt.ALONG_X, TeachPrompt.ALONG_Z) for step in steps)
    if ways:
        plan = tr(
            "You touch the pin: {asks} times. You show moves along the tool's axes: "
            "{ways}. The robot moves by itself: {moves} times.",
            asks=asks,
            ways=ways,
            moves=moves,
        )
    elif asks:
        plan = tr(
            "You touch the pin: {asks} times. The robot moves by itself: {moves} times.",
            asks=asks,
            moves=moves,
        )
    else:
        plan = tr("The robot moves by itself: {moves} times. Nobody touches anything.", moves=moves)
    note(tr("{plan} All moves stay in the allowed area.", plan=plan))


def show_plan(payload: Mapping[str, object]) -> None:
    """Show a dry run."""
    say(tr("Dry run; nothing is sent. The measurement of tool {tool}:", tool=payload["tool"]))
    show_steps(payload["steps"])


def show_steps(steps: object) -> None:
    """Show the steps of :mod:`robolink_cli.views.documents`."""
    assert isinstance(steps, list)  # noqa: S101 - made by planned_steps
    for at, step in enumerate(steps, start=1):
        say(f"{at:3}. {step['text']}")
        for request in step["requests"]:
            say(f"       {request}")
        if step["refusal"]:
            say(f"       {step['refusal']}")
    say(
        tr(
            "These are the measuring steps. The write and the turn test, if any, depend on "
            "the result."
        )
    )
