"""A table of poses as a case: whatever file of poses there is, for a method that takes poses."""

from pathlib import Path

from robolink.pose_tables import ReadingChoices, TabledPose, read_poses
from robolink_cli.commands.measure.solve.case import Node


def table_case(
    path: Path,
    *,
    method: str,
    choices: ReadingChoices,
    sigma_mm: float | None,
    threshold_mm: float | None,
) -> Node:
    """Return the case of a file of poses.

    Args:
        path: The file (docs/poses.md, "Files of poses").
        method: A method that takes poses on one point.
        choices: What the file does not say.
        sigma_mm: Standard deviation of one placement, if it is known.
        threshold_mm: Residual beyond which a robust method rejects a pose.

    Raises:
        AmbiguousPosesError: The file can be read in more than one way.
        CalibrationError: ``non_finite``.
        ConfigError: It cannot be read or is no list of poses.
    """
    given: dict[str, object] = {
        "poses": [_as_case(one) for one in read_poses(path, choices).entries]
    }
    given |= {} if sigma_mm is None else {"sigma_mm": sigma_mm}
    given |= {} if threshold_mm is None else {"inlier_threshold": threshold_mm}
    return Node({"id": path.name, "method": method, "input": given}, "")


def _as_case(entry: TabledPose) -> dict[str, object]:
    pose = entry.pose
    case: dict[str, object] = dict(zip("xyzuvw", pose.coordinates(), strict=True))
    case["local"] = pose.local
    case |= {} if pose.hand is None else {"hand": str(pose.hand)}
    return case if pose.tool is None else {**case, "tool": pose.tool}
