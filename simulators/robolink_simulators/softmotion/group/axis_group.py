"""A simulated SoftMotion axis group: its function blocks as methods, in simulated time.

Theory of operation. A block acts at the instant that the group was given last and returns an
:class:`~robolink_simulators.softmotion.function_blocks.BlockExecution`, whose outputs change as
time passes. The group owns no thread and no clock: whoever hosts it calls ``advance`` and asks
``next_change`` when to call again.
"""

from robolink_simulators.softmotion.group.move_blocks import MoveBlocks
from robolink_simulators.softmotion.group.state_blocks import StateBlocks
from robolink_simulators.softmotion.group.tool_blocks import ToolBlocks


class AxisGroup(StateBlocks, MoveBlocks, ToolBlocks):
    """One axis group with its drives, and the signals beside it."""
