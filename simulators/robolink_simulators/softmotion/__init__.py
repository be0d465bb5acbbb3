"""A simulated CODESYS SoftMotion axis group: SIMULATED, no runtime system is involved.

What is simulated and on what evidence stands in docs/simulated-softmotion.md; the facts are
those of docs/reference/softmotion.md.
"""

from robolink_simulators.softmotion.axes import AxisLimits as AxisLimits
from robolink_simulators.softmotion.axes import AxisState as AxisState
from robolink_simulators.softmotion.blocks import BlockState as BlockState
from robolink_simulators.softmotion.blocks import Execution as Execution
from robolink_simulators.softmotion.blocks import Outputs as Outputs
from robolink_simulators.softmotion.catalogue import MachineModel as MachineModel
from robolink_simulators.softmotion.catalogue import machine_named as machine_named
from robolink_simulators.softmotion.condition import GroupState as GroupState
from robolink_simulators.softmotion.condition import GroupStatus as GroupStatus
from robolink_simulators.softmotion.condition import ReadToolMode as ReadToolMode
from robolink_simulators.softmotion.coordinates import CoordRef as CoordRef
from robolink_simulators.softmotion.coordinates import CoordSystem as CoordSystem
from robolink_simulators.softmotion.group import AxisGroup as AxisGroup
from robolink_simulators.softmotion.jog import JogCommand as JogCommand
from robolink_simulators.softmotion.movement import BufferMode as BufferMode
from robolink_simulators.softmotion.movement import EdgeWatch as EdgeWatch
from robolink_simulators.softmotion.movement import Tool as Tool
from robolink_simulators.softmotion.options import GroupOptions as GroupOptions
from robolink_simulators.softmotion.options import SmcNumbers as SmcNumbers
from robolink_simulators.softmotion.paths import Dynamics as Dynamics
from robolink_simulators.softmotion.planner import Target as Target
from robolink_simulators.softmotion.smc_errors import ErrorKind as ErrorKind
from robolink_simulators.softmotion.smc_errors import Refused as Refused
from robolink_simulators.softmotion.smc_errors import SmcError as SmcError
from robolink_simulators.softmotion.world import SoftMotionWorld as SoftMotionWorld
