"""What a nozzle change records: poses, verdicts, decisions, the place of the pin."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, fields, replace
from statistics import fmean
from typing import Any

from robolink.calibration import (
    NORMAL_95,
    CalibrationResult,
    Drift,
    NeedleChain,
    VerifyResult,
    chain_of,
    offset_sigma_mm,
)
from robolink.calibration_run._acceptance import AcceptanceCriteria
from robolink.calibration_run._proposal import Proposal
from robolink.calibration_run._repeatability import TouchWitness, touched_by
from robolink.errors import CalibrationError, RobolinkError
from robolink.messages import tr
from robolink.methods import AnyMethod, NextStep, all_methods
from robolink.model import (
    ControllerFacts,
    EntryKind,
    NewEntry,
    OutcomeLog,
    Pose,
    ToolOffset,
    json_fields,
    json_value,
    plain_offset,
)
from robolink.procedures import jog_mm
from robolink.runner import SeenAt, TouchedAt
from robolink.stations import Found, Gauge, Station, StationKind
from robolink.timing import wall_time


def calibration_entry(
    proposal: Proposal,
    criteria: AcceptanceCriteria,
    *,
    source: str,
    facts: ControllerFacts | None = None,
    simulated: bool = False,
    gauge: Gauge | None = None,
) -> NewEntry:
    """Return the record of an accepted measurement, with all that it rests on.

    Args:
        proposal: What was measured.
        criteria: What was allowed.
        source: How it was measured, one sentence.
        facts: Which machine it was, where it was asked.
        simulated: Whether the controller says that nothing real moves.
        gauge: The gauge that was measured against, where one is known.
    """
    result = proposal.result
    details: dict[str, object] = {
        "source": source,
        "before": plain_offset(proposal.before),
        "proposed": plain_offset(result.offset),
        "tip": plain_offset(proposal.tip),
        "notes": list(proposal.notes),
        # Entries are labelled in UTC; people at the cell know the local time.
        "local_time": wall_time().astimezone().isoformat(timespec="seconds"),
        **({} if facts is None else {"facts": asdict(facts)}),
        **({"simulated": True} if simulated else {}),
        "gauges": [] if gauge is None else [asdict(gauge)],
        **_result(result),
        "seating": json_value(proposal.seating),
        **proposal.record,
    }
    return NewEntry(
        EntryKind.CALIBRATION,
        tool=proposal.tool,
        tolerance=criteria.tolerance,
        verdict=_measured(proposal),
        details=details,
    )


def _measured(proposal: Proposal) -> str:
    """Return the offset in words: what was measured of it, then what was not."""
    found = proposal.result.found
    if proposal.z_from == "measured":
        found = (*found, "z_mm")
    own: list[str] = []
    others: list[str] = []
    for field in fields(ToolOffset):
        # Adding zero removes the sign from a value that rounds to zero.
        value = round(getattr(proposal.offset, field.name), 3) + 0.0
        axis, measured = field.name[0].upper(), field.name in found
        if measured or axis not in "VW" or value:
            (own if measured else others).append(f"{axis} {value:.3f}")
    if not others:
        return tr("measured: {offset}", offset=" ".join(own))
    return tr(
        "measured: {offset}; not measured: {others}",
        offset=" ".join(own),
        others=" ".join(others),
    )


def refusal_entry(
    tool: int, criteria: AcceptanceCriteria, error: BaseException, *, poses: Sequence[Pose] = ()
) -> NewEntry:
    """Return the record of a refused or unfinished measurement.

    Args:
        tool: Number of the tool.
        criteria: What was allowed.
        error: What ended it.
        poses: The touches so far; they are for the record and never used again.
    """
    why = error.what if isinstance(error, RobolinkError) else tr("interrupted")
    code = error.code if isinstance(error, CalibrationError) else type(error).__name__
    return NewEntry(
        EntryKind.REFUSED,
        tool=tool,
        tolerance=criteria.tolerance,
        verdict=why,
        details={
            "code": code,
            "poses": [_pose(pose) for pose in poses],
            **_seen(poses),
            **touches_made(poses),
        },
    )


def verification_entry(
    tool: int, result: VerifyResult, *, tests: Sequence[VerifyResult] = ()
) -> NewEntry:
    """Return the record of a turn test.

    Args:
        tool: Number of the tool.
        result: What it says.
        tests: Each time that it was made, where that is more than once.
    """
    verdict = tr("passed") if result.passed else tr("failed")
    details: dict[str, object] = {
        **json_fields(result, "passed", "max_drift_mm", "tolerance_mm", "drifts", "warnings"),
        "verdict": result.codes[0] if result.codes else result.verdict.value,
        "judgement": json_value(result.judgement),
        **({"tests": [json_value(one.drifts) for one in tests]} if len(tests) > 1 else {}),
        **touches_made(result.inputs),
    }
    return NewEntry(
        EntryKind.VERIFY,
        tool=tool,
        tolerance=tr("drift up to {limit:g} mm", limit=result.tolerance_mm),
        verdict=tr("{verdict}: {drift:.3f} mm", verdict=verdict, drift=result.max_drift_mm),
        details=details,
    )


def tests_on_record(outcomes: OutcomeLog, tool: int, proof: VerifyResult) -> list[VerifyResult]:
    """Return the recorded turn tests of this change that contradicted its measurement.

    Whoever ends the process and begins anew does not get rid of what was seen.

    Args:
        outcomes: The record, with the id of the change.
        tool: Number of the tool.
        proof: The test that follows them; theirs are held to its limit.
    """
    made = outcomes.recorded(tool=tool, change=outcomes.change, kinds=(EntryKind.VERIFY,))
    last = next(iter(made), None) if outcomes.change else None
    if last is None:
        return []
    details: Mapping[str, Any] = last.details
    if not (details.get("judgement") or {}).get("code"):
        return []
    found = details.get("tests") or [details["drifts"]]
    return [
        replace(proof, drifts=tuple(Drift(**drift) for drift in drifts), inputs=(), warnings=())
        for drifts in found
    ]


def decision_entry(verdict: str, **details: object) -> NewEntry:
    """Return the record of a person's decision."""
    return NewEntry(EntryKind.DECISION, verdict=verdict, details=details)


def _result(result: CalibrationResult) -> dict[str, object]:
    return {
        **json_fields(result, "method", "measured", "kept"),
        **(json_fields(result, "changed") if result.changed else {}),
        "reference_point_mm": list(result.reference_point_mm),
        "poses": [_pose(pose) for pose in result.inputs],
        **_seen(result.inputs),
        **touches_made(result.inputs),
        **json_fields(result, "residuals_mm", "rejected", "rms_mm", "max_residual_mm"),
        **json_fields(result, "covariance", "half_width95", "sigma_mm", "sigma_stated", "dof"),
        **json_fields(result, "sigma_gain", "condition_number", "warnings", information="notes"),
        **json_fields(result, "interval_from", "region95_radius_mm", "budget", "evidence"),
        **json_fields(result, "repeatable_to_mm", "accurate_to_mm"),
        "accuracy": result.accuracy.as_json(result.measured) if result.accuracy else None,
        **result.details(),
    }


def _pose(pose: Pose) -> dict[str, object]:
    values = json_fields(pose, *(field.name for field in fields(Pose)))
    return {name: value for name, value in values.items() if value is not None}


def touches_made(poses: Sequence[Pose]) -> dict[str, object]:
    """Return how a person made each touch, plain JSON; nothing if nobody touched anything.

    ``touches`` has one entry a pose: where the robot had stopped, the standoff from there to the
    expected contact, how far was jogged, after how many seconds it was answered, whether an input
    switched to contact meanwhile, and, where it is so, that the pose was typed. ``standoff_seed``
    is what the standoffs were drawn from.
    """
    if not any(isinstance(pose, TouchedAt) for pose in poses):
        return {}
    touched = [_touch(pose) if isinstance(pose, TouchedAt) else None for pose in poses]
    seeds = {pose.seed for pose in poses if isinstance(pose, TouchedAt)} - {None}
    return {"touches": touched, "standoff_seed": min(seeds, default=None, key=str)}


def _touch(touch: TouchedAt) -> dict[str, object]:
    return {
        "arrival": None if touch.arrival is None else _pose(touch.arrival),
        "standoff_mm": list(touch.standoff_mm),
        "jog_mm": jog_mm(touch),
        "answered_s": touch.seconds,
        "contact": touch.contact,
        **({"typed": True} if touch.typed else {}),
    }


def _seen(poses: Sequence[Pose]) -> dict[str, object]:
    """Return what a camera saw from each pose, in its own unit; nothing without one."""
    looks = [pose for pose in poses if isinstance(pose, SeenAt)]
    if not looks:
        return {}
    spots = [[pose.spot.x, pose.spot.y] if isinstance(pose, SeenAt) else None for pose in poses]
    return {"spots": spots, "spots_in": looks[0].unit.value}


def finds_pin(result: CalibrationResult) -> bool:
    """Return whether a measurement found the pin itself, with the offset."""
    return any(method.needs.finds_pin for method in _methods_of(result))


def tells_height(result: CalibrationResult) -> bool:
    """Return whether the heights of the touches show the tip's length, besides what was solved."""
    return "z_mm" not in result.found and any(method.tells_height for method in _methods_of(result))


def next_steps(result: CalibrationResult, tool: int) -> tuple[NextStep, ...]:
    """Return what a person does next with a written tool; nothing for most methods.

    Args:
        result: The measurement.
        tool: Number of the tool.
    """
    made = (method.next_steps for method in _methods_of(result))
    return tuple(step for make in made if make is not None for step in make(tool))


def _methods_of(result: CalibrationResult) -> Iterator[AnyMethod]:
    yield from (method for method in all_methods() if method.name == result.method)


def require_pin_in_base(station: str, result: CalibrationResult) -> None:
    """Refuse to keep a pin's place that was found from poses of a local coordinate system.

    The tip comes out the same in every local, the pin does not (docs/reference/evidence.md 4).

    Args:
        station: Name of the pin that is to be kept; empty for none.
        result: What was measured.

    Raises:
        CalibrationError: ``local_pose``.
    """
    local = next((pose.local for pose in _kept_inputs(result) if pose.local), 0)
    if not station or not local:
        return
    raise CalibrationError(
        "local_pose",
        tr(
            "These are positions in Local {local}, but the place of station {station} is "
            "recorded in the base.",
            local=local,
            station=station,
        ),
        remedy=tr("Record them in Local 0, or name no station: robolink then still finds the tip."),
    )


def touch_heights_mm(proposal: Proposal) -> list[float]:
    """Return the pin's height by each touch, if the tip is as long as the value says; base."""
    value = proposal.offset
    return [contact_of(pose, value)[2] for pose in _kept_inputs(proposal.result)]


def contact_of(pose: Pose, offset: ToolOffset) -> tuple[float, float, float]:
    """Return where a touch puts the pin, if the tip is where an offset says; base."""
    x_mm, y_mm, z_mm = _turned(pose, offset)
    return pose.x_mm + x_mm, pose.y_mm + y_mm, pose.z_mm + z_mm


def _kept_inputs(result: CalibrationResult) -> list[Pose]:
    return [pose for i, pose in enumerate(result.inputs) if i not in result.rejected]


def _turned(pose: Pose, offset: ToolOffset) -> tuple[float, float, float]:
    """Return an offset in base axes."""
    from robolink.calibration import rotation_of  # numpy, imported late

    rows = rotation_of(pose).tolist()
    along = offset.components()[:3]
    x, y, z = (sum(r * a for r, a in zip(row, along, strict=True)) for row in rows)
    return x, y, z


def pin_mm(proposal: Proposal) -> tuple[float, float, float]:
    """Return where the measured offset puts the pin, base."""
    result, tip = proposal.result, proposal.tip
    x_mm, y_mm = result.reference_point_mm[:2]
    if len(result.reference_point_mm) == 3:
        return x_mm, y_mm, result.reference_point_mm[2]
    heights = [contact_of(pose, tip)[2] for pose in _kept_inputs(result)]
    return x_mm, y_mm, fmean(heights)


def _touch_sigma_mm(result: CalibrationResult) -> float | None:
    """Return the same for one coordinate of one touch."""
    offset_mm = offset_sigma_mm(result)
    if offset_mm is None or result.sigma_mm is None:
        return None
    if result.sigma_stated and result.interval_from != "residuals":
        return result.sigma_mm
    largest = max(
        result.covariance[index][index]
        for index, name in enumerate(result.measured)
        if name.endswith("_mm")
    )
    return result.sigma_mm * offset_mm / math.sqrt(largest) if largest else result.sigma_mm


def found_pin(station: str, proposal: Proposal, known: Station | None = None) -> Found | None:
    """Return where a full calibration found the pin; ``None`` for one that only used it.

    Its height is never taken from a Z that was only kept: where the tip is another, the pin would
    be as wrong as the tip. What is known of the height then stays, unless the pin moved.

    Args:
        station: Name of the pin.
        proposal: The calibration.
        known: The pin as it was known before.
    """
    result = proposal.result
    if not finds_pin(result):
        return None
    x_mm, y_mm, measured_z_mm = pin_mm(proposal)
    z_mm, z_from = _height(proposal, measured_z_mm, known)
    return Found(
        id=station,
        kind=StationKind.PIN,
        x_mm=x_mm,
        y_mm=y_mm,
        z_mm=z_mm,
        # The pin's place is as uncertain as the tip: both have the same role in the equations.
        sigma_mm=offset_sigma_mm(result),
        how=tr("{method} with tool {tool}", method=result.method, tool=proposal.tool),
        tool=proposal.tool,
        details={"z_from": z_from, **_spread(result)},
    )


def _height(
    proposal: Proposal, measured_mm: float, known: Station | None
) -> tuple[float | None, str]:
    """Return the height of the pin and where it comes from."""
    if "z_mm" in proposal.result.measured:
        return measured_mm, "measured"
    if proposal.z_from == "typed":
        return measured_mm, "typed"
    if known is None or known.z_mm is None or "station_moved" in proposal.result.warnings:
        return None, ""
    return known.z_mm, str(known.details.get("z_from", ""))


def _spread(result: CalibrationResult) -> dict[str, object]:
    """Return the covariance of the pin, base, mm^2: as large as that of the tip, and turned."""
    lengths = [i for i, name in enumerate(result.measured) if name.endswith("_mm")]
    if not result.covariance or len(lengths) not in (2, 3):
        return {}
    # The normal equations of tip and pin differ only by a rotation; the worst axis stands for all.
    # Widened like the interval for few degrees of freedom, which a later reader does not know.
    half = max(result.half_width95[i] for i in lengths)
    variance = (half / NORMAL_95) ** 2
    rows = [[variance if i == j else 0.0 for j in lengths] for i in lengths]
    return {"covariance_mm2": rows}


def touch_details(station: str, proposal: Proposal) -> dict[str, object]:
    """Return what the journal keeps of the pin besides an accepted value."""
    result = proposal.result
    chain = chain_of(result) or NeedleChain(offset_sigma_mm(result) or 0.0)
    x_mm, y_mm, z_mm = pin_mm(proposal)
    # The next nozzle makes one upright touch: compare it with the last upright touch of this one.
    touch = min(reversed(result.inputs), key=lambda pose: abs(pose.v_deg) + abs(pose.w_deg))
    # If a difference was written, the stored value puts the pin elsewhere than the tip does.
    tip, value = _turned(touch, proposal.tip), _turned(touch, proposal.offset)
    heights = touch_heights_mm(proposal)
    height_mm = z_mm + value[2] - tip[2] if proposal.pin_z_mm is None else proposal.pin_z_mm
    return {
        "station": station,
        "x_mm": x_mm + value[0] - tip[0],
        "y_mm": y_mm + value[1] - tip[1],
        "z_mm": height_mm,
        "u_deg": touch.u_deg,
        **json_fields(chain, "sigma_mm", "changes", "full_sigma_mm"),
        "touch_sigma_mm": _touch_sigma_mm(result),
        # For tilted touches, Z comes from the fit, and their heights say nothing about it.
        **({} if "z_mm" in result.found else _scatter(heights, touched_by(result.inputs))),
        "touches": proposal.pin_touches or len(result.inputs) - len(result.rejected),
    }


def _scatter(heights_mm: Sequence[float], by: TouchWitness) -> dict[str, object]:
    """Return how much the heights of one run differ, for pooling with others."""
    mean = fmean(heights_mm)
    return {
        "heights_mm2": sum((height - mean) ** 2 for height in heights_mm),
        "heights_dof": len(heights_mm) - 1,
        "heights_by": by,
    }
