"""Files with poses of any origin: read as they are, without guesses."""

from robolink.pose_tables.formats.epson_points import parse_pts, read_pts
from robolink.pose_tables.orientation import RULES, RotationRule
from robolink.pose_tables.reader import read_poses
from robolink.pose_tables.values import (
    NOTHING_SAID,
    HowRead,
    LengthUnit,
    PoseTable,
    ReadingChoices,
    TabledPose,
)

__all__ = [
    "HowRead",
    "LengthUnit",
    "NOTHING_SAID",
    "PoseTable",
    "RULES",
    "ReadingChoices",
    "RotationRule",
    "TabledPose",
    "parse_pts",
    "read_poses",
    "read_pts",
]
