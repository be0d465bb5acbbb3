"""A simulated CODESYS SoftMotion axis group: SIMULATED, no runtime system is involved.

What is simulated and on what evidence stands in docs/simulated-softmotion.md; the facts are
those of docs/reference/softmotion.md.
"""

from robolink_simulators.softmotion.catalogue import MachineModel as MachineModel
from robolink_simulators.softmotion.catalogue import machine_named as machine_named
from robolink_simulators.softmotion.function_blocks import BlockExecution as BlockExecution
from robolink_simulators.softmotion.function_blocks import BlockOutputs as BlockOutputs
from robolink_simulators.softmotion.function_blocks import BlockState as BlockState
from robolink_simulators.softmotion.group.axis_group import AxisGroup as AxisGroup
from robolink_simulators.softmotion.group.condition import GroupStatus as GroupStatus
from robolink_simulators.softmotion.group.condition import ReadToolMode as ReadToolMode
from robolink_simulators.softmotion.group.condition import SmcGroupState as SmcGroupState
from robolink_simulators.softmotion.kinematics.coordinates import CoordRef as CoordRef
from robolink_simulators.softmotion.kinematics.coordinates import CoordSystem as CoordSystem
from robolink_simulators.softmotion.motion.axes import AxisLimits as AxisLimits
from robolink_simulators.softmotion.motion.axes import AxisState as AxisState
from robolink_simulators.softmotion.motion.jog import JogCommand as JogCommand
from robolink_simulators.softmotion.motion.movement import EdgeWatch as EdgeWatch
from robolink_simulators.softmotion.motion.movement import SmcBufferMode as SmcBufferMode
from robolink_simulators.softmotion.motion.movement import ToolInForce as ToolInForce
from robolink_simulators.softmotion.motion.paths import Dynamics as Dynamics
from robolink_simulators.softmotion.motion.planner import Target as Target
from robolink_simulators.softmotion.options import GroupOptions as GroupOptions
from robolink_simulators.softmotion.options import SmcNumbers as SmcNumbers
from robolink_simulators.softmotion.smc_errors import BlockRefused as BlockRefused
from robolink_simulators.softmotion.smc_errors import ErrorKind as ErrorKind
from robolink_simulators.softmotion.smc_errors import SmcError as SmcError
from robolink_simulators.softmotion.world import SoftMotionWorld as SoftMotionWorld
