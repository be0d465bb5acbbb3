"""Programs of makers of robots, each told by what none of the others writes."""

from collections.abc import Callable
from typing import Final

from robolink.pose_tables.formats.abb import read_abb
from robolink.pose_tables.formats.fanuc import read_fanuc
from robolink.pose_tables.formats.kuka import read_kuka
from robolink.pose_tables.formats.mitsubishi import read_mitsubishi
from robolink.pose_tables.formats.urscript import read_urscript
from robolink.pose_tables.values import RawTable

READERS: Final[tuple[Callable[[str], RawTable | None], ...]] = (
    read_fanuc,
    read_abb,
    read_kuka,
    read_mitsubishi,
    read_urscript,
)
"""In the order in which they are asked."""
