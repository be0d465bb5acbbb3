"""What a measurement is repeatable to and accurate to, in words and as tables."""

from collections.abc import Iterator
from typing import Final

from robolink.calibration import (
    Accuracy,
    CalibrationResult,
    RowInWords,
    chain_of,
    known_doubts,
    measured_axes,
    order_in_words,
    rows_in_words,
    stated_mm,
    statement_sentences,
)
from robolink.messages import tr
from robolink_cli.console.render import table
from robolink_cli.views.documents import number


def remarks(result: CalibrationResult) -> Iterator[str]:
    """Yield what there is to say about a measurement beside its numbers, a sentence each."""
    for said in (_fit, _order):
        yield from filter(None, (said(result),))
    yield from statement_sentences(result)
    for said in (_each_axis, _change, _ways, _needle, _camera, _runout, _chain):
        yield from filter(None, (said(result),))
    yield from known_doubts(note for note in result.notes if note not in _SAID_OTHERWISE)


_SAID_OTHERWISE: Final = ("length_not_observable",)
"""Notes whose reason the proposal gives, in a sentence of its own."""


def _fit(result: CalibrationResult) -> str:
    """Return how well the poses agree, in one sentence; empty where a statement says why not."""
    if result.rms_mm is None:
        if result.repeatable_to_mm is None and measured_axes(result):
            return ""
        if result.method == "one-touch":
            return tr("One touch cannot be checked.")
        if result.method == "two-pose":
            return tr("Two touches cannot check each other.")
        return tr("Nothing is left over that could check it.")
    return tr(
        "The {count} touches agree within {rms:.3f} mm; the worst is {largest:.3f} mm off.",
        count=len(result.residuals_mm) - len(result.rejected),
        rms=result.rms_mm,
        largest=result.max_residual_mm,
    )


def _order(result: CalibrationResult) -> str:
    """Return what moved while the poses were taken, by how much; empty where nothing did."""
    order = result.evidence.run_order if result.evidence is not None else None
    return order_in_words(order) if order is not None else ""


def _each_axis(result: CalibrationResult) -> str:
    """Return the 95 % interval of each measured component alone; empty when nothing tells it."""
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
    """Return by how much Z changed, and what is known of Z itself; empty for other methods."""
    details = result.details()
    by_mm, half_mm = details.get("change_z_mm"), details.get("change_z_half95_mm")
    stored = details.get("stored_z")
    if not isinstance(by_mm, float) or not isinstance(half_mm, float):
        return ""
    told = tr("change of Z (95 %): {by:+.3f} +-{half:.3f} mm", by=by_mm, half=half_mm)
    if "z_mm" in result.changed or not isinstance(stored, dict):
        return told
    return tr(
        "{told}; the stored Z was measured: entry {number} of the journal",
        told=told,
        number=stored["entry"],
    )


def _ways(result: CalibrationResult) -> str:
    """Return how square the ways along a tool's axes were; empty for other methods."""
    off_deg = result.details().get("off_square_deg")
    if not isinstance(off_deg, float):
        return ""
    return tr("The moves are {off:.2f} degrees off a right angle.", off=abs(off_deg))


def _needle(result: CalibrationResult) -> str:
    """Return how a needle leans, and what that changed; empty where that shows in no digit."""
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
    """Return what a measurement says about its camera; empty where it says nothing."""
    if not result.details():
        return ""
    from robolink.calibration import CameraCalibration, CameraRound  # numpy, loaded by then

    if isinstance(result, CameraRound) and result.camera_error_mm is not None:
        dx_mm, dy_mm = result.camera_error_mm
        return tr(
            "the camera sees things X {dx:+.3f} Y {dy:+.3f} mm beside where they are",
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
    """Return where in a chain of differences this one stands; empty for other methods."""
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
    """Show what makes up the statement of accuracy, a row each, the largest first."""
    columns = (tr("row"), tr("half width"), tr("known from"), tr("share %"))
    rows = [
        [row.title, f"+-{row.half_width}" if row.half_width else "", row.basis, _share(row)]
        for row in rows_in_words(accuracy)
    ]
    table(tr("What it is accurate to, row by row"), columns, rows)


def _share(row: RowInWords) -> str:
    return f"{row.share_percent:.0f}"
