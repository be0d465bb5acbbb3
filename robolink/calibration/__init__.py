"""Where the tool tip is: pure procedures and solvers. No I/O."""

from robolink.calibration._result import CalibrationResult as CalibrationResult
from robolink.calibration._result import Drift as Drift
from robolink.calibration._result import VerifyResult as VerifyResult
from robolink.calibration._steps import Ask as Ask
from robolink.calibration._steps import Move as Move
from robolink.calibration._steps import Procedure as Procedure
from robolink.calibration._steps import Step as Step
from robolink.calibration._touch import TouchPlan as TouchPlan
from robolink.calibration._touch import contact_pose as contact_pose
from robolink.calibration._touch import raised as raised
from robolink.calibration._touch import two_pose as two_pose
from robolink.calibration._touch import verify_by_turning as verify_by_turning
from robolink.calibration._two_pose import solve_two_pose as solve_two_pose
