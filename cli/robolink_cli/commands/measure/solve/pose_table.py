"""A table of poses as a case: whatever file of poses there is, for a method that takes poses."""

from pathlib import Path

from robolink.errors import CalibrationError
from robolink.messages import tr
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
        CalibrationError: ``non_finite``; ``tool_pose`` for poses of another tool.
        ConfigError: It cannot be read or is no list of poses.
    """
    entries = read_poses(path, choices).entries
    other = next((one.pose.tool for one in entries if one.pose.tool), None)
    if other is not None:
        raise CalibrationError(
            "tool_pose",
            tr("The poses were taken with tool {other}, not {tool}.", other=other, tool=0),
            remedy=tr("Take them with the flange, Tool 0; offline nothing knows another tool."),
        )
    given: dict[str, object] = {"poses": [_as_case(one) for one in entries], "as_taught": True}
    given |= {} if sigma_mm is None else {"sigma_mm": sigma_mm}
    given |= {} if threshold_mm is None else {"inlier_threshold": threshold_mm}
    return Node({"id": path.name, "method": method, "input": given}, "")


def _as_case(entry: TabledPose) -> dict[str, object]:
    pose = entry.pose
    case: dict[str, object] = dict(zip("xyzuvw", pose.coordinates(), strict=True))
    case["local"] = pose.local
    case |= {} if pose.hand is None else {"hand": str(pose.hand)}
    return case if pose.tool is None else {**case, "tool": pose.tool}
