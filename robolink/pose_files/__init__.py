"""Files with poses: touch poses as JSON or CSV, and the point files of EPSON RC+."""

from robolink.pose_files._poses import read_poses as read_poses
from robolink.pose_files._pts import parse_pts as parse_pts
from robolink.pose_files._pts import read_pts as read_pts
