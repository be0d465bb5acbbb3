"""Files with poses, whoever wrote them: read as they are, and never guessed at."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.pose_tables.formats.epson_points import parse_pts as parse_pts
    from robolink.pose_tables.formats.epson_points import read_pts as read_pts
    from robolink.pose_tables.orientation import RULES as RULES
    from robolink.pose_tables.orientation import RotationRule as RotationRule
    from robolink.pose_tables.reader import read_poses as read_poses
    from robolink.pose_tables.values import NOTHING_SAID as NOTHING_SAID
    from robolink.pose_tables.values import HowRead as HowRead
    from robolink.pose_tables.values import LengthUnit as LengthUnit
    from robolink.pose_tables.values import PoseTable as PoseTable
    from robolink.pose_tables.values import ReadingChoices as ReadingChoices
    from robolink.pose_tables.values import TabledPose as TabledPose
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "formats.epson_points": "parse_pts read_pts",
            "orientation": "RULES RotationRule",
            "reader": "read_poses",
            "values": "HowRead LengthUnit NOTHING_SAID PoseTable ReadingChoices TabledPose",
        },
    )
