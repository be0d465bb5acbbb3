"""What commands show: plain payloads, and the tables made from them."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from robolink.model import COMPONENTS, Controller, angle_difference_deg, json_fields, json_value

if TYPE_CHECKING:
    from robolink.calibration import CalibrationResult, VerifyResult
    from robolink.calibration_run import Proposal
    from robolink.model import Finding, Pose, ToolOffset, ToolReceipt


def pose_payload(pose: "Pose") -> dict[str, object]:
    """Return a pose with its units in the keys."""
    payload = json_fields(pose, *COMPONENTS, "hand", "local", "tool")
    return payload if pose.posture is None else payload | json_fields(pose, "posture")


def receipt_payload(receipt: "ToolReceipt") -> dict[str, object]:
    """Return what a write or clear did."""
    offsets = ("before", "requested", "read_back")
    return json_fields(receipt, "tool", *offsets, "skipped", "unconditional")


def proposal_payload(proposal: "Proposal") -> dict[str, object]:
    """Return a calibration's proposal next to what is stored."""
    result = proposal.result
    return {
        "tool": proposal.tool,
        "method": result.method,
        "before": json_value(proposal.before),
        "proposed": json_value(result.offset),
        **json_fields(proposal, "tip", "notes"),
        **json_fields(result, "measured", "changed"),
        **json_fields(proposal, "kept", "change_mm"),
        **json_fields(result, "reference_point_mm", "sigma_gain", "warnings"),
        "poses": [pose_payload(pose) for pose in result.inputs],
        **_touches_payload(result.inputs),
        "fit": fit_payload(result),
        "length": length_payload(proposal),
        "seating": json_value(proposal.seating),
        **result.details(),
    }


def _touches_payload(poses: "Sequence[Pose]") -> dict[str, object]:
    """Return how each touch was made, as the journal has it; ``None`` where nobody touched."""
    from robolink.calibration_run import touches_made  # here, because a status needs no numpy

    return {"touches": None, "standoff_seed": None, **touches_made(poses)}


def length_payload(proposal: "Proposal") -> dict[str, object] | None:
    """Return what the heights of the touches tell about the length, ``None`` for nothing."""
    told = proposal.length
    if told is None:
        return None
    told_of = ("changed", "height_change_mm", "u_mm", "limit_mm", "stored_z_mm")
    written = "difference" if told.changed and proposal.z_from == "measured" else "keep"
    return {**json_fields(told, *told_of, "z_by_difference_mm"), "written": written}


def fit_payload(result: "CalibrationResult") -> dict[str, object]:
    """Return what a measurement is repeatable to and accurate to; what nothing tells is ``None``.

    ``half_width95``, ``interval_from``, ``region95_radius_mm`` and ``budget`` are what it is
    repeatable to, as before there was a statement of accuracy.
    """
    from robolink.calibration import chain_of  # here, because a status needs no numpy

    chain = chain_of(result)
    accuracy = result.accuracy
    return {
        **json_fields(result, "repeatable_to_mm", "accurate_to_mm"),
        "accuracy": accuracy.as_json(result.measured) if accuracy else None,
        "half_width95": dict(zip(result.measured, result.half_width95, strict=False)),
        **json_fields(result, "sigma_mm", "sigma_stated"),
        "interval_from": result.interval_from or None,
        **json_fields(result, "region95_radius_mm", "notes", "budget", "evidence"),
        **json_fields(result, "rms_mm", "max_residual_mm", "residuals_mm", "rejected"),
        **json_fields(result, "condition_number", "dof", "unobservable"),
        "chain": json_fields(chain, "changes", "sigma_mm") if chain else None,
    }


def verification_payload(result: "VerifyResult | None") -> dict[str, object] | None:
    """Return the drift about the new tip."""
    if result is None:
        return None
    drift = ("u_deg", "dx_mm", "dy_mm", "dz_mm", "distance_mm")
    return {
        **json_fields(result, "max_drift_mm", "tolerance_mm", "passed"),
        **json_fields(result, "judgement", "accurate_to_mm"),
        "drifts": [json_fields(one, *drift) for one in result.drifts],
        **_touches_payload(result.inputs),
    }


def finding_payload(finding: "Finding") -> dict[str, object]:
    """Return what was found out about an open marker."""
    return {
        **json_fields(finding.marker, "operation", "kind", "request", "begun_at"),
        **json_fields(finding, "verdict", "sentence", "action"),
    }


def status_payload(controller: "Controller") -> dict[str, object]:
    """Return the flags, and what more can be read now."""
    known = json_fields(
        controller.status(),
        *("state", "remote", "ready", "running", "paused", "fault", "serious_fault"),
        *("emergency_stop", "guard_open", "warning", "teach", "test", "code"),
    )
    return {"controller": controller.identity, **known, **controller.condition()}


def offset_difference(before: "ToolOffset", after: "ToolOffset") -> dict[str, float]:
    """Return how far each component of an offset moved, angles by the shorter way."""
    pairs = zip(COMPONENTS, after.components(), before.components(), strict=True)
    return {
        name: angle_difference_deg(new, old) if name.endswith("_deg") else new - old
        for name, new, old in pairs
    }


def number(value: object) -> str:
    """Return a table cell for a length or an angle."""
    return f"{value:.3f}" if isinstance(value, (int, float)) else "-"


def offset_cells(offset: Mapping[str, object] | None) -> list[str]:
    """Return six table cells for an offset payload."""
    return [number(offset[name]) if offset else "-" for name in COMPONENTS]
