"""The nozzle change: measure the new tips, write their offsets, prove them, or undo it."""

from robolink.nozzle_change._change import Earlier as Earlier
from robolink.nozzle_change._change import NozzleChange as NozzleChange
from robolink.nozzle_change._crossed_beams import CrossedBeams as CrossedBeams
from robolink.nozzle_change._flange import flange_pose as flange_pose
from robolink.nozzle_change._gate import Gate as Gate
from robolink.nozzle_change._given_poses import GivenPoses as GivenPoses
from robolink.nozzle_change._given_poses import PointReader as PointReader
from robolink.nozzle_change._given_poses import PosesFound as PosesFound
from robolink.nozzle_change._given_poses import taught_poses as taught_poses
from robolink.nozzle_change._listener import Listener as Listener
from robolink.nozzle_change._listener import Moment as Moment
from robolink.nozzle_change._plan import ChangePlan as ChangePlan
from robolink.nozzle_change._plan import Limits as Limits
from robolink.nozzle_change._plan import ToolPlan as ToolPlan
from robolink.nozzle_change._preview import PlannedStep as PlannedStep
from robolink.nozzle_change._preview import preview as preview
from robolink.nozzle_change._proposal import ChangeReport as ChangeReport
from robolink.nozzle_change._proposal import Proposal as Proposal
from robolink.nozzle_change._proposal import ToolReport as ToolReport
from robolink.nozzle_change._source import Bench as Bench
from robolink.nozzle_change._source import MovingSource as MovingSource
from robolink.nozzle_change._source import TipSource as TipSource
from robolink.nozzle_change._touch_probe import TouchProbe as TouchProbe
from robolink.nozzle_change._touching import PinAndPerson as PinAndPerson
