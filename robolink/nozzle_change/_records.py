"""What a nozzle change puts on record: raw poses, verdicts in words, decisions."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from typing import Any

from robolink.calibration import CalibrationResult, Drift, VerifyResult
from robolink.errors import CalibrationError, RobolinkError
from robolink.messages import tr
from robolink.model import (
    ControllerFacts,
    EntryKind,
    NewEntry,
    OutcomeLog,
    Pose,
    ToolOffset,
    plain_offset,
)
from robolink.nozzle_change._acceptance import AcceptanceCriteria
from robolink.nozzle_change._proposal import Proposal
from robolink.procedures import jog_mm
from robolink.runner import SeenAt, TouchedAt
from robolink.stations import Gauge
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
    """Return the record of a measurement that was believed, with all that it rests on.

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
        # Entries are labelled in UTC; whoever stood there knows it by the clock on the wall.
        "local_time": wall_time().astimezone().isoformat(timespec="seconds"),
        **({} if facts is None else {"facts": asdict(facts)}),
        **({"simulated": True} if simulated else {}),
        "gauges": [] if gauge is None else [asdict(gauge)],
        **_result(result),
        "seating": proposal.seating.as_json() if proposal.seating else None,
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
        # Adding zero takes the sign off what rounds to zero.
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
    """Return the record of a measurement that was not believed, or not finished.

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
    """Return the record of a test about the new tip.

    Args:
        tool: Number of the tool.
        result: What it says.
        tests: Each time that it was made, where that is more than once.
    """
    verdict = tr("passed") if result.passed else tr("failed")
    details: dict[str, object] = {
        "passed": result.passed,
        "max_drift_mm": result.max_drift_mm,
        "tolerance_mm": result.tolerance_mm,
        "drifts": _drifts(result),
        "warnings": list(result.warnings),
        "verdict": result.codes[0] if result.codes else result.verdict.value,
        "judgement": result.judgement.as_json() if result.judgement else None,
        **({"tests": [_drifts(one) for one in tests]} if len(tests) > 1 else {}),
        **touches_made(result.inputs),
    }
    return NewEntry(
        EntryKind.VERIFY,
        tool=tool,
        tolerance=tr("drift up to {limit:g} mm", limit=result.tolerance_mm),
        verdict=tr("{verdict}: {drift:.3f} mm", verdict=verdict, drift=result.max_drift_mm),
        details=details,
    )


def _drifts(result: VerifyResult) -> list[dict[str, object]]:
    return [asdict(drift) for drift in result.drifts]


def tests_on_record(outcomes: OutcomeLog, tool: int, proof: VerifyResult) -> list[VerifyResult]:
    """Return the turn tests of the change under way that contradicted its measurement.

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
    """Return the record of what a person decided."""
    return NewEntry(EntryKind.DECISION, verdict=verdict, details=details)


def _result(result: CalibrationResult) -> dict[str, object]:
    return {
        "method": result.method,
        "measured": list(result.measured),
        "kept": list(result.kept),
        **({"changed": list(result.changed)} if result.changed else {}),
        "reference_point_mm": list(result.reference_point_mm),
        "poses": [_pose(pose) for pose in result.inputs],
        **_seen(result.inputs),
        **touches_made(result.inputs),
        "residuals_mm": [list(residual) for residual in result.residuals_mm],
        "rejected": list(result.rejected),
        "rms_mm": result.rms_mm,
        "max_residual_mm": result.max_residual_mm,
        "covariance": [list(row) for row in result.covariance],
        "half_width95": list(result.half_width95),
        "sigma_mm": result.sigma_mm,
        "sigma_stated": result.sigma_stated,
        "dof": result.dof,
        "sigma_gain": result.sigma_gain,
        "condition_number": result.condition_number,
        "warnings": list(result.warnings),
        "information": list(result.notes),
        "interval_from": result.interval_from,
        "region95_radius_mm": result.region95_radius_mm,
        "budget": result.budget.as_json() if result.budget else None,
        "evidence": result.evidence.as_json() if result.evidence else None,
        "repeatable_to_mm": result.repeatable_to_mm,
        "accurate_to_mm": result.accurate_to_mm,
        "accuracy": result.accuracy.as_json(result.measured) if result.accuracy else None,
        **result.details(),
    }


def _pose(pose: Pose) -> dict[str, object]:
    values = {field.name: getattr(pose, field.name) for field in fields(Pose)}
    if pose.posture is not None:
        values["posture"] = asdict(pose.posture)
    return {name: value for name, value in values.items() if value is not None}


def touches_made(poses: Sequence[Pose]) -> dict[str, object]:
    """Return how a person made each touch, plain JSON; nothing where nobody touched anything.

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
