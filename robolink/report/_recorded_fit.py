"""A measurement as the journal has it."""

from collections.abc import Mapping
from typing import Any

from robolink.calibration import Accuracy, CalibrationResult, UncertaintyBudget
from robolink.model import (
    Elbow,
    Hand,
    Pose,
    Posture,
    ToolOffset,
    Wrist,
    method_name_now,
    read_offset,
)


def recorded_fit(details: Mapping[str, Any]) -> CalibrationResult:
    """Return what a measurement came to, from the details of its entry.

    What older entries do not say is left empty.

    Raises:
        ConfigError, KeyError, TypeError, ValueError: The entry cannot be understood.
    """
    return CalibrationResult(
        method=method_name_now(details["method"]),
        offset=read_offset(details["proposed"]) or ToolOffset(),
        measured=tuple(details["measured"]),
        kept=tuple(details.get("kept", ())),
        changed=tuple(details.get("changed", ())),
        reference_point_mm=tuple(details.get("reference_point_mm", ())),
        sigma_gain=details.get("sigma_gain", 1.0),
        warnings=tuple(details.get("warnings", ())),
        inputs=tuple(map(recorded_pose, details.get("poses", ()))),
        covariance=_vectors(details.get("covariance", ())),
        half_width95=tuple(details.get("half_width95", ())),
        sigma_mm=details.get("sigma_mm"),
        sigma_stated=details.get("sigma_stated", False),
        rms_mm=details.get("rms_mm"),
        max_residual_mm=details.get("max_residual_mm"),
        residuals_mm=_vectors(details.get("residuals_mm", ())),
        rejected=tuple(details.get("rejected", ())),
        condition_number=details.get("condition_number"),
        dof=details.get("dof"),
        notes=tuple(details.get("information", ())),
        interval_from=details.get("interval_from", ""),
        region95_radius_mm=details.get("region95_radius_mm"),
        budget=UncertaintyBudget.from_json(budget) if (budget := details.get("budget")) else None,
        accuracy=Accuracy.from_json(accuracy) if (accuracy := details.get("accuracy")) else None,
    )


def recorded_pose(pose: Mapping[str, Any]) -> Pose:
    """Return a pose of an entry."""
    hand, posture = pose.get("hand"), pose.get("posture")
    flags: dict[str, Any] = {"hand": Hand(hand) if hand else None}
    if posture is not None:
        elbow, wrist = Elbow(posture["elbow"]), Wrist(posture["wrist"])
        flags["posture"] = Posture(**{**posture, "elbow": elbow, "wrist": wrist})
    return Pose(**{**pose, **flags})


def _vectors(rows: Any) -> tuple[tuple[float, ...], ...]:  # noqa: ANN401 - read from JSON
    return tuple(map(tuple, rows))
