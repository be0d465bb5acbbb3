"""Programs of makers of robots, each told by what none of the others writes."""

from collections.abc import Callable
from typing import Final

from robolink.pose_tables.programs.abb import read_abb
from robolink.pose_tables.programs.fanuc import read_fanuc
from robolink.pose_tables.programs.kuka import read_kuka
from robolink.pose_tables.programs.mitsubishi import read_mitsubishi
from robolink.pose_tables.programs.urscript import read_urscript
from robolink.pose_tables.values import RawTable

READERS: Final[tuple[Callable[[str], RawTable | None], ...]] = (
    read_fanuc,
    read_abb,
    read_kuka,
    read_mitsubishi,
    read_urscript,
)
"""In the order in which they are asked."""
