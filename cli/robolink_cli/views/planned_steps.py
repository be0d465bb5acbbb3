"""The foreseen steps of a measurement, for a document."""

from collections.abc import Sequence

from robolink.calibration_run import PlannedStep
from robolink.model import Controller
from robolink_cli.views.documents import pose_payload


def steps_payload(controller: Controller, steps: Sequence[PlannedStep]) -> list[dict[str, object]]:
    """Return foreseen steps with their requests and limit checks."""
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
