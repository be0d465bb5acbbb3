"""Where the tool tip is: pure procedures and solvers. No I/O.

Solvers that need numpy are loaded when they are first used, because a command that only looks
at the controller should not wait for it.
"""

from typing import TYPE_CHECKING

from robolink.calibration._angle_touches import n_angle as n_angle
from robolink.calibration._angle_touches import telling_order as telling_order
from robolink.calibration._board import LEAST_SPACING_MM as LEAST_SPACING_MM
from robolink.calibration._camera_model import CameraLimits as CameraLimits
from robolink.calibration._camera_model import CameraModel as CameraModel
from robolink.calibration._camera_model import require_same_camera as require_same_camera
from robolink.calibration._camera_station import HALF_ROUND_DEG as HALF_ROUND_DEG
from robolink.calibration._camera_station import LEAST_SPAN_MM as LEAST_SPAN_MM
from robolink.calibration._camera_station import TWO_ANGLES_DEG as TWO_ANGLES_DEG
from robolink.calibration._camera_station import CameraStation as CameraStation
from robolink.calibration._camera_station import LookPlan as LookPlan
from robolink.calibration._camera_station import PatternPlan as PatternPlan
from robolink.calibration._held_board import BoardDrawing as BoardDrawing
from robolink.calibration._impact import Impact as Impact
from robolink.calibration._impact import PointImpact as PointImpact
from robolink.calibration._impact import impact_on as impact_on
from robolink.calibration._moved_station import StationShift as StationShift
from robolink.calibration._moved_station import TipShift as TipShift
from robolink.calibration._moved_station import judge_shifts as judge_shifts
from robolink.calibration._needle_chain import NeedleChain as NeedleChain
from robolink.calibration._needle_chain import NeedleLimits as NeedleLimits
from robolink.calibration._needle_chain import chain_of as chain_of
from robolink.calibration._planar_checks import MIN_ROTATION_DEG as MIN_ROTATION_DEG
from robolink.calibration._planar_checks import angle_spread_deg as angle_spread_deg
from robolink.calibration._planar_checks import planar_sigma_gain as planar_sigma_gain
from robolink.calibration._poses import ToolFit as ToolFit
from robolink.calibration._poses import better_fit as better_fit
from robolink.calibration._poses import tool_fits as tool_fits
from robolink.calibration._poses import two_of as two_of
from robolink.calibration._result import CalibrationResult as CalibrationResult
from robolink.calibration._result import Drift as Drift
from robolink.calibration._result import VerifyResult as VerifyResult
from robolink.calibration._single_touch import one_touch as one_touch
from robolink.calibration._stations import BeamStation as BeamStation
from robolink.calibration._stations import CrossingPlan as CrossingPlan
from robolink.calibration._stations import ProbePlan as ProbePlan
from robolink.calibration._stations import TouchStation as TouchStation
from robolink.calibration._steps import Ask as Ask
from robolink.calibration._steps import Look as Look
from robolink.calibration._steps import Move as Move
from robolink.calibration._steps import Offer as Offer
from robolink.calibration._steps import Procedure as Procedure
from robolink.calibration._steps import Seek as Seek
from robolink.calibration._steps import SeenAt as SeenAt
from robolink.calibration._steps import Shown as Shown
from robolink.calibration._steps import Step as Step
from robolink.calibration._steps import Tell as Tell
from robolink.calibration._student import NORMAL_95 as NORMAL_95
from robolink.calibration._taking import Course as Course
from robolink.calibration._tolerance import PLANAR_TOLERANCE as PLANAR_TOLERANCE
from robolink.calibration._tolerance import TOUCH_TOLERANCE as TOUCH_TOLERANCE
from robolink.calibration._tolerance import Tolerance as Tolerance
from robolink.calibration._touch import TouchPlan as TouchPlan
from robolink.calibration._touch import contact_pose as contact_pose
from robolink.calibration._touch import raised as raised
from robolink.calibration._touch import travel as travel
from robolink.calibration._touch import two_pose as two_pose
from robolink.calibration._touch import verify_by_turning as verify_by_turning
from robolink.calibration._turning import toward_zero as toward_zero
from robolink.calibration._two_pose import solve_two_pose as solve_two_pose

if TYPE_CHECKING:
    from robolink.calibration._beams import Beam as Beam
    from robolink.calibration._beams import Crossing as Crossing
    from robolink.calibration._beams import find_beams as find_beams
    from robolink.calibration._board import solve_board as solve_board
    from robolink.calibration._board_fit import solve_board_fit as solve_board_fit
    from robolink.calibration._board_round import solve_board_round as solve_board_round
    from robolink.calibration._camera import Sighting as Sighting
    from robolink.calibration._camera import solve_up_camera as solve_up_camera
    from robolink.calibration._camera_affine import CameraCalibration as CameraCalibration
    from robolink.calibration._camera_affine import PixelSighting as PixelSighting
    from robolink.calibration._camera_affine import solve_camera_affine as solve_camera_affine
    from robolink.calibration._camera_round import CameraRound as CameraRound
    from robolink.calibration._camera_round import solve_camera_round as solve_camera_round
    from robolink.calibration._crossed_beams import BeamsResult as BeamsResult
    from robolink.calibration._crossed_beams import solve_crossed_beams as solve_crossed_beams
    from robolink.calibration._crossing import cross_beams as cross_beams
    from robolink.calibration._crossing import trace_beams as trace_beams
    from robolink.calibration._crossing import verify_by_crossing as verify_by_crossing
    from robolink.calibration._joint import JointResult as JointResult
    from robolink.calibration._joint import JointTouch as JointTouch
    from robolink.calibration._joint import ToolDifference as ToolDifference
    from robolink.calibration._joint import solve_joint as solve_joint
    from robolink.calibration._looking import find_camera as find_camera
    from robolink.calibration._looking import look_at_board as look_at_board
    from robolink.calibration._looking import look_at_tip as look_at_tip
    from robolink.calibration._looking_again import verify_board as verify_board
    from robolink.calibration._looking_again import verify_by_looking as verify_by_looking
    from robolink.calibration._n_angle import solve_n_angle as solve_n_angle
    from robolink.calibration._needle_change import NeedleChangeResult as NeedleChangeResult
    from robolink.calibration._needle_change import solve_needle_change as solve_needle_change
    from robolink.calibration._one_touch import Pin as Pin
    from robolink.calibration._one_touch import pin_touched as pin_touched
    from robolink.calibration._one_touch import solve_one_touch as solve_one_touch
    from robolink.calibration._pivot import solve_pivot as solve_pivot
    from robolink.calibration._pivot_fit import PivotDesign as PivotDesign
    from robolink.calibration._pivot_fit import PivotFit as PivotFit
    from robolink.calibration._pivot_fit import fit_pivot as fit_pivot
    from robolink.calibration._pivot_fit import fit_pivot_robust as fit_pivot_robust
    from robolink.calibration._pivot_fit import pivot_design as pivot_design
    from robolink.calibration._robust import Robust as Robust
    from robolink.calibration._rotations import quaternion_rotations as quaternion_rotations
    from robolink.calibration._rotations import rotation_of as rotation_of
    from robolink.calibration._rotations import uvw_deg as uvw_deg
    from robolink.calibration._rotations import zyz_deg as zyz_deg
    from robolink.calibration._runout import RunoutReport as RunoutReport
    from robolink.calibration._runout import runout_report as runout_report
    from robolink.calibration._shown_axes import WayPlan as WayPlan
    from robolink.calibration._shown_axes import six_point as six_point
    from robolink.calibration._six_point import SixPointResult as SixPointResult
    from robolink.calibration._six_point import ToolAxis as ToolAxis
    from robolink.calibration._six_point import solve_six_point as solve_six_point
    from robolink.calibration._six_point import solve_tool_axis as solve_tool_axis
    from robolink.calibration._suggest import PoseLimits as PoseLimits
    from robolink.calibration._suggest import PosePlan as PosePlan
    from robolink.calibration._suggest import precise_enough as precise_enough
    from robolink.calibration._suggest import suggest_poses as suggest_poses
    from robolink.calibration._tilted_touches import pivot as pivot
    from robolink.calibration._tilted_touches import verify_by_tilting as verify_by_tilting
    from robolink.calibration._tilts import OverPin as OverPin
    from robolink.calibration._tilts import Tilt as Tilt
    from robolink.calibration._tilts import proving_tilts as proving_tilts
    from robolink.calibration._tilts import telling_tilts as telling_tilts
    from robolink.calibration._touching_off import touch_off as touch_off
    from robolink.calibration._touching_off import verify_by_touching as verify_by_touching
    from robolink.calibration._update_guard import NEEDLE_LIMIT_MM as NEEDLE_LIMIT_MM
    from robolink.calibration._update_guard import Correction as Correction
    from robolink.calibration._update_guard import require_shrinking as require_shrinking
    from robolink.calibration._update_guard import update_guard as update_guard
    from robolink.calibration._verify import PLACING_TOLERANCE_MM as PLACING_TOLERANCE_MM
    from robolink.calibration._verify import verify_drift as verify_drift
    from robolink.calibration._z_touch import Touch as Touch
    from robolink.calibration._z_touch import ZTouchResult as ZTouchResult
    from robolink.calibration._z_touch import solve_z_touch as solve_z_touch

_LOADED_LATER = {
    "Beam": "_beams",
    "Crossing": "_beams",
    "find_beams": "_beams",
    "solve_board": "_board",
    "solve_board_fit": "_board_fit",
    "solve_board_round": "_board_round",
    "Sighting": "_camera",
    "solve_up_camera": "_camera",
    "CameraCalibration": "_camera_affine",
    "PixelSighting": "_camera_affine",
    "solve_camera_affine": "_camera_affine",
    "BeamsResult": "_crossed_beams",
    "solve_crossed_beams": "_crossed_beams",
    "cross_beams": "_crossing",
    "trace_beams": "_crossing",
    "verify_by_crossing": "_crossing",
    "CameraRound": "_camera_round",
    "solve_camera_round": "_camera_round",
    "JointResult": "_joint",
    "JointTouch": "_joint",
    "ToolDifference": "_joint",
    "solve_joint": "_joint",
    "find_camera": "_looking",
    "look_at_board": "_looking",
    "look_at_tip": "_looking",
    "verify_board": "_looking_again",
    "verify_by_looking": "_looking_again",
    "solve_n_angle": "_n_angle",
    "NeedleChangeResult": "_needle_change",
    "solve_needle_change": "_needle_change",
    "Pin": "_one_touch",
    "pin_touched": "_one_touch",
    "solve_one_touch": "_one_touch",
    "solve_pivot": "_pivot",
    "PivotDesign": "_pivot_fit",
    "PivotFit": "_pivot_fit",
    "fit_pivot": "_pivot_fit",
    "fit_pivot_robust": "_pivot_fit",
    "pivot_design": "_pivot_fit",
    "Robust": "_robust",
    "quaternion_rotations": "_rotations",
    "rotation_of": "_rotations",
    "uvw_deg": "_rotations",
    "zyz_deg": "_rotations",
    "RunoutReport": "_runout",
    "runout_report": "_runout",
    "WayPlan": "_shown_axes",
    "six_point": "_shown_axes",
    "SixPointResult": "_six_point",
    "ToolAxis": "_six_point",
    "solve_six_point": "_six_point",
    "solve_tool_axis": "_six_point",
    "PoseLimits": "_suggest",
    "PosePlan": "_suggest",
    "precise_enough": "_suggest",
    "suggest_poses": "_suggest",
    "pivot": "_tilted_touches",
    "verify_by_tilting": "_tilted_touches",
    "OverPin": "_tilts",
    "Tilt": "_tilts",
    "proving_tilts": "_tilts",
    "telling_tilts": "_tilts",
    "touch_off": "_touching_off",
    "verify_by_touching": "_touching_off",
    "Correction": "_update_guard",
    "require_shrinking": "_update_guard",
    "NEEDLE_LIMIT_MM": "_update_guard",
    "update_guard": "_update_guard",
    "PLACING_TOLERANCE_MM": "_verify",
    "verify_drift": "_verify",
    "Touch": "_z_touch",
    "ZTouchResult": "_z_touch",
    "solve_z_touch": "_z_touch",
}


def __getattr__(name: str) -> object:
    """Load a solver from its module (PEP 562)."""
    if name not in _LOADED_LATER:
        raise AttributeError(f"module 'robolink.calibration' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"robolink.calibration.{_LOADED_LATER[name]}"), name)
    globals()[name] = value
    return value
