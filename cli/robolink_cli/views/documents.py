"""What commands show: plain payloads, and the tables made from them."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from robolink_cli.console.render import plain

if TYPE_CHECKING:
    from robolink.calibration import CalibrationResult, VerifyResult
    from robolink.calibration_run import Proposal
    from robolink.model import Controller, Finding, Pose, ToolOffset, ToolReceipt


COMPONENTS = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")
AXES = ("X mm", "Y mm", "Z mm", "U deg", "V deg", "W deg")


def offset_payload(offset: "ToolOffset | None") -> dict[str, float] | None:
    """Return an offset with its units in the keys, ``None`` for an undefined tool."""
    if offset is None:
        return None
    return dict(zip(COMPONENTS, offset.components(), strict=True))


def pose_payload(pose: "Pose") -> dict[str, object]:
    """Return a pose with its units in the keys."""
    payload: dict[str, object] = dict(zip(COMPONENTS, pose.coordinates(), strict=True))
    payload |= {"hand": pose.hand, "local": pose.local, "tool": pose.tool}
    return payload if pose.posture is None else payload | {"posture": asdict(pose.posture)}


def receipt_payload(receipt: "ToolReceipt") -> dict[str, object]:
    """Return what a write or clear did."""
    return {
        "tool": receipt.tool,
        "before": offset_payload(receipt.before),
        "requested": offset_payload(receipt.requested),
        "read_back": offset_payload(receipt.read_back),
        "skipped": receipt.skipped,
        "unconditional": receipt.unconditional,
    }


def proposal_payload(proposal: "Proposal") -> dict[str, object]:
    """Return a calibration's proposal next to what is stored."""
    result = proposal.result
    return {
        "tool": proposal.tool,
        "method": result.method,
        "before": offset_payload(proposal.before),
        "proposed": offset_payload(result.offset),
        "tip": offset_payload(proposal.tip),
        "notes": list(proposal.notes),
        "measured": list(result.measured),
        "changed": list(result.changed),
        "kept": list(proposal.kept),
        "change_mm": proposal.change_mm,
        **plain(result, "reference_point_mm sigma_gain warnings"),
        "poses": [pose_payload(pose) for pose in result.inputs],
        **_touches_payload(result.inputs),
        "fit": fit_payload(result),
        "length": length_payload(proposal),
        "seating": proposal.seating.as_json() if proposal.seating else None,
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
    return {
        **plain(told, "changed height_change_mm u_mm limit_mm stored_z_mm z_by_difference_mm"),
        "written": "difference" if told.changed and proposal.z_from == "measured" else "keep",
    }


def fit_payload(result: "CalibrationResult") -> dict[str, object]:
    """Return what a measurement is repeatable to and accurate to; what nothing tells is ``None``.

    ``half_width95``, ``interval_from``, ``region95_radius_mm`` and ``budget`` are what it is
    repeatable to, as before there was a statement of accuracy.
    """
    from robolink.calibration import chain_of  # here, because a status needs no numpy

    chain = chain_of(result)
    accuracy = result.accuracy
    return {
        "repeatable_to_mm": result.repeatable_to_mm,
        "accurate_to_mm": result.accurate_to_mm,
        "accuracy": accuracy.as_json(result.measured) if accuracy else None,
        "half_width95": dict(zip(result.measured, result.half_width95, strict=False)),
        "sigma_mm": result.sigma_mm,
        "sigma_stated": result.sigma_stated,
        "interval_from": result.interval_from or None,
        "region95_radius_mm": result.region95_radius_mm,
        "notes": list(result.notes),
        "budget": result.budget.as_json() if result.budget else None,
        "evidence": result.evidence.as_json() if result.evidence else None,
        "rms_mm": result.rms_mm,
        "max_residual_mm": result.max_residual_mm,
        "residuals_mm": [list(residual) for residual in result.residuals_mm],
        **plain(result, "rejected condition_number dof unobservable"),
        "chain": {"changes": chain.changes, "sigma_mm": chain.sigma_mm} if chain else None,
    }


def verification_payload(result: "VerifyResult | None") -> dict[str, object] | None:
    """Return the drift about the new tip."""
    if result is None:
        return None
    return {
        **plain(result, "max_drift_mm tolerance_mm passed"),
        "judgement": result.judgement.as_json() if result.judgement else None,
        "accurate_to_mm": result.accurate_to_mm,
        "drifts": [
            {
                **plain(drift, "u_deg dx_mm dy_mm dz_mm distance_mm"),
            }
            for drift in result.drifts
        ],
        **_touches_payload(result.inputs),
    }


def finding_payload(finding: "Finding") -> dict[str, object]:
    """Return what was found out about an open marker."""
    return {
        **plain(finding.marker, "operation kind request begun_at"),
        **plain(finding, "verdict sentence action"),
    }


def status_payload(controller: "Controller") -> dict[str, object]:
    """Return the flags, and what more can be read now."""
    status = controller.status()
    return {
        "controller": controller.identity,
        **plain(status, "state remote ready running paused fault serious_fault emergency_stop"),
        **plain(status, "guard_open warning teach test code"),
        **controller.condition(),
    }


def number(value: object) -> str:
    """Return a table cell for a length or an angle."""
    return f"{value:.3f}" if isinstance(value, (int, float)) else "-"


def offset_cells(offset: Mapping[str, object] | None) -> list[str]:
    """Return six table cells for an offset payload."""
    return [number(offset[name]) if offset else "-" for name in COMPONENTS]
