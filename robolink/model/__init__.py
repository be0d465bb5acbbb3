"""Values and interfaces. No I/O."""

from robolink.model._controller import Capabilities as Capabilities
from robolink.model._controller import Controller as Controller
from robolink.model._controller import ControllerState as ControllerState
from robolink.model._controller import ControllerStatus as ControllerStatus
from robolink.model._facts import ControllerFacts as ControllerFacts
from robolink.model._geometry import Hand as Hand
from robolink.model._geometry import Pose as Pose
from robolink.model._geometry import angle_difference_deg as angle_difference_deg
from robolink.model._geometry import rotate_xy as rotate_xy
from robolink.model._motion import Motion as Motion
from robolink.model._motion import MotionGroup as MotionGroup
from robolink.model._motion import MotionOutcome as MotionOutcome
from robolink.model._motion import MotionProfile as MotionProfile
from robolink.model._motion import Path as Path
from robolink.model._motion import WorkBox as WorkBox
from robolink.model._outcomes import Marker as Marker
from robolink.model._outcomes import MarkerKind as MarkerKind
from robolink.model._outcomes import OutcomeLog as OutcomeLog
from robolink.model._secret import Secret as Secret
from robolink.model._tools import ANY as ANY
from robolink.model._tools import Expect as Expect
from robolink.model._tools import Expected as Expected
from robolink.model._tools import ToolOffset as ToolOffset
from robolink.model._tools import ToolReceipt as ToolReceipt
from robolink.model._tools import ToolTable as ToolTable
