"""A simulated CODESYS SoftMotion axis group: SIMULATED, no runtime system is involved.

What is simulated and on what evidence stands in docs/reference/simulated-softmotion.md; the facts
are those of docs/reference/softmotion.md.
"""

from robolink_simulators.softmotion.catalogue import MachineModel, machine_named
from robolink_simulators.softmotion.function_blocks import BlockExecution, BlockOutputs, BlockState
from robolink_simulators.softmotion.group.axes import AxisLimits, AxisState
from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.group.condition import GroupStatus, ReadToolMode, SmcGroupState
from robolink_simulators.softmotion.group.jog import JogCommand
from robolink_simulators.softmotion.group.movement import EdgeWatch, SmcBufferMode, ToolInForce
from robolink_simulators.softmotion.group.paths import Dynamics, Target
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef, CoordSystem
from robolink_simulators.softmotion.options import GroupOptions, SmcNumbers
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind, SmcError
from robolink_simulators.softmotion.world import SoftMotionWorld

__all__ = [
    "AxisGroup",
    "AxisLimits",
    "AxisState",
    "BlockExecution",
    "BlockOutputs",
    "BlockRefused",
    "BlockState",
    "CoordRef",
    "CoordSystem",
    "Dynamics",
    "EdgeWatch",
    "ErrorKind",
    "GroupOptions",
    "GroupStatus",
    "JogCommand",
    "MachineModel",
    "ReadToolMode",
    "SmcBufferMode",
    "SmcError",
    "SmcGroupState",
    "SmcNumbers",
    "SoftMotionWorld",
    "Target",
    "ToolInForce",
    "machine_named",
]
