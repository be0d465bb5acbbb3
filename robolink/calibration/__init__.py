"""Calculates where the tool tip is. No I/O.

Its names are loaded when they are first used, because a command that only looks at the controller
should not wait for numpy.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.calibration.beam_lines import Beam as Beam
    from robolink.calibration.beam_lines import Crossing as Crossing
    from robolink.calibration.beam_lines import Lean as Lean
    from robolink.calibration.beam_lines import ShaftSeen as ShaftSeen
    from robolink.calibration.beam_lines import find_beams as find_beams
    from robolink.calibration.camera.board import LEAST_SPACING_MM as LEAST_SPACING_MM
    from robolink.calibration.camera.board import BoardDrawing as BoardDrawing
    from robolink.calibration.camera.board import solve_board as solve_board
    from robolink.calibration.camera.board_fit import solve_board_fit as solve_board_fit
    from robolink.calibration.camera.board_fit import solve_board_round as solve_board_round
    from robolink.calibration.camera.camera_affine import CameraCalibration as CameraCalibration
    from robolink.calibration.camera.camera_affine import PixelSighting as PixelSighting
    from robolink.calibration.camera.camera_affine import solve_camera_affine as solve_camera_affine
    from robolink.calibration.camera.camera_model import USUAL_CAMERA as USUAL_CAMERA
    from robolink.calibration.camera.camera_model import CameraLimits as CameraLimits
    from robolink.calibration.camera.camera_model import CameraModel as CameraModel
    from robolink.calibration.camera.camera_model import Sighting as Sighting
    from robolink.calibration.camera.camera_model import require_same_camera as require_same_camera
    from robolink.calibration.camera.camera_round import CameraRound as CameraRound
    from robolink.calibration.camera.camera_round import as_round as as_round
    from robolink.calibration.camera.camera_round import solve_camera_round as solve_camera_round
    from robolink.calibration.camera.known_movement import CameraChangeRows as CameraChangeRows
    from robolink.calibration.camera.known_movement import MovementVerdict as MovementVerdict
    from robolink.calibration.camera.known_movement import SeenMovement as SeenMovement
    from robolink.calibration.camera.known_movement import camera_changed as camera_changed
    from robolink.calibration.camera.known_movement import mm_camera_noise as mm_camera_noise
    from robolink.calibration.camera.known_movement import same_radius as same_radius
    from robolink.calibration.camera.known_movement import spot_changed as spot_changed
    from robolink.calibration.camera.known_movement import tip_did_not_move as tip_did_not_move
    from robolink.calibration.camera.runout import RunoutReport as RunoutReport
    from robolink.calibration.camera.runout import RunoutRow as RunoutRow
    from robolink.calibration.camera.runout import RunoutTable as RunoutTable
    from robolink.calibration.camera.runout import RunoutTableResult as RunoutTableResult
    from robolink.calibration.camera.runout import runout_report as runout_report
    from robolink.calibration.camera.runout import solve_runout_table as solve_runout_table
    from robolink.calibration.camera.up_camera import solve_up_camera as solve_up_camera
    from robolink.calibration.core.accuracy import ACCURACY_ROWS as ACCURACY_ROWS
    from robolink.calibration.core.accuracy import DIVISORS as DIVISORS
    from robolink.calibration.core.accuracy import Accuracy as Accuracy
    from robolink.calibration.core.accuracy import AccuracyFacts as AccuracyFacts
    from robolink.calibration.core.accuracy import AccuracyRow as AccuracyRow
    from robolink.calibration.core.accuracy import AssessedRow as AssessedRow
    from robolink.calibration.core.accuracy import BudgetRow as BudgetRow
    from robolink.calibration.core.accuracy import ErrorSource as ErrorSource
    from robolink.calibration.core.accuracy import RowFact as RowFact
    from robolink.calibration.core.accuracy import UncertaintyBudget as UncertaintyBudget
    from robolink.calibration.core.dispersion import require_positive as require_positive
    from robolink.calibration.core.frames import flange_of as flange_of
    from robolink.calibration.core.frames import flange_pose as flange_pose
    from robolink.calibration.core.frames import flange_poses as flange_poses
    from robolink.calibration.core.frames import in_base as in_base
    from robolink.calibration.core.frames import seen_from as seen_from
    from robolink.calibration.core.frames import tilted_flange_pose as tilted_flange_pose
    from robolink.calibration.core.frames import tilted_from as tilted_from
    from robolink.calibration.core.frames import tip_pose as tip_pose
    from robolink.calibration.core.frames import toward_zero as toward_zero
    from robolink.calibration.core.least_squares import Floats as Floats
    from robolink.calibration.core.least_squares import Robust as Robust
    from robolink.calibration.core.least_squares import linear_fit as linear_fit
    from robolink.calibration.core.pose_checks import MIN_ROTATION_DEG as MIN_ROTATION_DEG
    from robolink.calibration.core.pose_checks import angle_spread_deg as angle_spread_deg
    from robolink.calibration.core.pose_checks import planar_sigma_gain as planar_sigma_gain
    from robolink.calibration.core.pose_suggestion import PoseLimits as PoseLimits
    from robolink.calibration.core.pose_suggestion import PosePlan as PosePlan
    from robolink.calibration.core.pose_suggestion import precise_enough as precise_enough
    from robolink.calibration.core.pose_suggestion import select_poses as select_poses
    from robolink.calibration.core.pose_suggestion import sigma_gain as sigma_gain
    from robolink.calibration.core.pose_suggestion import suggest_poses as suggest_poses
    from robolink.calibration.core.result import GUARD_FACTOR as GUARD_FACTOR
    from robolink.calibration.core.result import LEAST_HALF_WIDTH as LEAST_HALF_WIDTH
    from robolink.calibration.core.result import PERSON_U_DRIFT_MM as PERSON_U_DRIFT_MM
    from robolink.calibration.core.result import CalibrationResult as CalibrationResult
    from robolink.calibration.core.result import Drift as Drift
    from robolink.calibration.core.result import DriftVerdict as DriftVerdict
    from robolink.calibration.core.result import FitEvidence as FitEvidence
    from robolink.calibration.core.result import ResidualVectors as ResidualVectors
    from robolink.calibration.core.result import RunOrder as RunOrder
    from robolink.calibration.core.result import VerifyResult as VerifyResult
    from robolink.calibration.core.result import judge_drift as judge_drift
    from robolink.calibration.core.result import offset_sigma_mm as offset_sigma_mm
    from robolink.calibration.core.result import worst_of as worst_of
    from robolink.calibration.core.rotations import pose_arrays as pose_arrays
    from robolink.calibration.core.rotations import quaternion_rotations as quaternion_rotations
    from robolink.calibration.core.rotations import rotation_of as rotation_of
    from robolink.calibration.core.rotations import rotations as rotations
    from robolink.calibration.core.rotations import uvw_deg as uvw_deg
    from robolink.calibration.core.rotations import zyz_deg as zyz_deg
    from robolink.calibration.core.statistics import NORMAL_95 as NORMAL_95
    from robolink.calibration.core.statistics import chi_square_quantile as chi_square_quantile
    from robolink.calibration.core.statistics import f_exceeded as f_exceeded
    from robolink.calibration.core.statistics import f_quantile as f_quantile
    from robolink.calibration.core.statistics import normal_quantile as normal_quantile
    from robolink.calibration.core.statistics import shifted_half95 as shifted_half95
    from robolink.calibration.core.statistics import shifted_region95 as shifted_region95
    from robolink.calibration.core.statistics import student_t as student_t
    from robolink.calibration.core.statistics import (
        studentized_range_0999 as studentized_range_0999,
    )
    from robolink.calibration.core.turn_claim import CONTRADICTS_ACCURACY as CONTRADICTS_ACCURACY
    from robolink.calibration.core.turn_claim import (
        CONTRADICTS_REPEATABILITY as CONTRADICTS_REPEATABILITY,
    )
    from robolink.calibration.core.turn_claim import REPEATED as REPEATED
    from robolink.calibration.core.turn_claim import SMALL_ANGLE as SMALL_ANGLE
    from robolink.calibration.core.turn_claim import DriftLimits as DriftLimits
    from robolink.calibration.core.turn_claim import TurnClaim as TurnClaim
    from robolink.calibration.core.turn_claim import TurnJudgement as TurnJudgement
    from robolink.calibration.crossed_beams import BeamsResult as BeamsResult
    from robolink.calibration.crossed_beams import crossing_sigma_gain as crossing_sigma_gain
    from robolink.calibration.crossed_beams import moved_beams as moved_beams
    from robolink.calibration.crossed_beams import solve_crossed_beams as solve_crossed_beams
    from robolink.calibration.crossed_beams import where_they_cross as where_they_cross
    from robolink.calibration.flange_plane import FlangePlane as FlangePlane
    from robolink.calibration.flange_plane import TipHeight as TipHeight
    from robolink.calibration.flange_plane import carrying as carrying
    from robolink.calibration.flange_plane import height_of as height_of
    from robolink.calibration.flange_plane import solvable_planes as solvable_planes
    from robolink.calibration.pin.joint import JointResult as JointResult
    from robolink.calibration.pin.joint import JointTouch as JointTouch
    from robolink.calibration.pin.joint import ToolDifference as ToolDifference
    from robolink.calibration.pin.joint import solve_joint as solve_joint
    from robolink.calibration.pin.n_angle import solve_n_angle as solve_n_angle
    from robolink.calibration.pin.needle_chain import NeedleChain as NeedleChain
    from robolink.calibration.pin.needle_chain import NeedleLimits as NeedleLimits
    from robolink.calibration.pin.needle_chain import StoredZ as StoredZ
    from robolink.calibration.pin.needle_chain import chain_of as chain_of
    from robolink.calibration.pin.needle_chain import chain_sigma_mm as chain_sigma_mm
    from robolink.calibration.pin.needle_change import NeedleChangeResult as NeedleChangeResult
    from robolink.calibration.pin.needle_change import solve_needle_change as solve_needle_change
    from robolink.calibration.pin.one_touch import Pin as Pin
    from robolink.calibration.pin.one_touch import pin_touched as pin_touched
    from robolink.calibration.pin.one_touch import solve_one_touch as solve_one_touch
    from robolink.calibration.pin.pivot import PivotDesign as PivotDesign
    from robolink.calibration.pin.pivot import PivotFit as PivotFit
    from robolink.calibration.pin.pivot import fit_pivot as fit_pivot
    from robolink.calibration.pin.pivot import fit_pivot_robust as fit_pivot_robust
    from robolink.calibration.pin.pivot import pivot_design as pivot_design
    from robolink.calibration.pin.pivot import solve_pivot as solve_pivot
    from robolink.calibration.pin.six_point import FAR_DEG as FAR_DEG
    from robolink.calibration.pin.six_point import GOOD_WAY_MM as GOOD_WAY_MM
    from robolink.calibration.pin.six_point import SixPointResult as SixPointResult
    from robolink.calibration.pin.six_point import ToolAxis as ToolAxis
    from robolink.calibration.pin.six_point import axis_displacement as axis_displacement
    from robolink.calibration.pin.six_point import between_deg as between_deg
    from robolink.calibration.pin.six_point import require_unturned as require_unturned
    from robolink.calibration.pin.six_point import solve_six_point as solve_six_point
    from robolink.calibration.pin.six_point import solve_tool_axis as solve_tool_axis
    from robolink.calibration.pin.two_pose import solve_two_pose as solve_two_pose
    from robolink.calibration.pin.two_pose import two_of as two_of
    from robolink.calibration.quality.control_chart import LEAST_BASELINE as LEAST_BASELINE
    from robolink.calibration.quality.control_chart import USUAL_LAMBDA as USUAL_LAMBDA
    from robolink.calibration.quality.control_chart import USUAL_WIDTH as USUAL_WIDTH
    from robolink.calibration.quality.control_chart import ControlChart as ControlChart
    from robolink.calibration.quality.control_chart import control_chart as control_chart
    from robolink.calibration.quality.doubts import BEYOND_TOLERANCE as BEYOND_TOLERANCE
    from robolink.calibration.quality.doubts import FARTHEST_MM as FARTHEST_MM
    from robolink.calibration.quality.doubts import HIGHEST_MM as HIGHEST_MM
    from robolink.calibration.quality.doubts import MOST_RESIDUAL_MM as MOST_RESIDUAL_MM
    from robolink.calibration.quality.doubts import PERSON_SIGMA_Z_MM as PERSON_SIGMA_Z_MM
    from robolink.calibration.quality.doubts import PLANAR_TOLERANCE as PLANAR_TOLERANCE
    from robolink.calibration.quality.doubts import PROBE_SIGMA_Z_MM as PROBE_SIGMA_Z_MM
    from robolink.calibration.quality.doubts import TOUCH_TOLERANCE as TOUCH_TOLERANCE
    from robolink.calibration.quality.doubts import Tolerance as Tolerance
    from robolink.calibration.quality.doubts import beyond_tolerance as beyond_tolerance
    from robolink.calibration.quality.doubts import doubt_sentence as doubt_sentence
    from robolink.calibration.quality.doubts import known_doubts as known_doubts
    from robolink.calibration.quality.doubts import order_in_words as order_in_words
    from robolink.calibration.quality.gauge_study import GaugeStudy as GaugeStudy
    from robolink.calibration.quality.gauge_study import gauge_study as gauge_study
    from robolink.calibration.quality.given_poses import RobotReach as RobotReach
    from robolink.calibration.quality.given_poses import ToolFit as ToolFit
    from robolink.calibration.quality.given_poses import better_fit as better_fit
    from robolink.calibration.quality.given_poses import fits_alike as fits_alike
    from robolink.calibration.quality.given_poses import require_near as require_near
    from robolink.calibration.quality.given_poses import (
        require_stored_scale as require_stored_scale,
    )
    from robolink.calibration.quality.given_poses import (
        require_within_reach as require_within_reach,
    )
    from robolink.calibration.quality.given_poses import tool_fits as tool_fits
    from robolink.calibration.quality.offset_change import NEEDLE_LIMIT_MM as NEEDLE_LIMIT_MM
    from robolink.calibration.quality.offset_change import Correction as Correction
    from robolink.calibration.quality.offset_change import Impact as Impact
    from robolink.calibration.quality.offset_change import PointImpact as PointImpact
    from robolink.calibration.quality.offset_change import impact_on as impact_on
    from robolink.calibration.quality.offset_change import require_shrinking as require_shrinking
    from robolink.calibration.quality.offset_change import update_guard as update_guard
    from robolink.calibration.quality.offset_change import (
        writes_refused_unattended as writes_refused_unattended,
    )
    from robolink.calibration.quality.pose_evidence import with_approach_bias as with_approach_bias
    from robolink.calibration.quality.station import SharedStation as SharedStation
    from robolink.calibration.quality.station import StationPart as StationPart
    from robolink.calibration.quality.station import StationShift as StationShift
    from robolink.calibration.quality.station import TipShift as TipShift
    from robolink.calibration.quality.station import judge_shifts as judge_shifts
    from robolink.calibration.quality.station import shared_station as shared_station
    from robolink.calibration.quality.station import with_station as with_station
    from robolink.calibration.quality.verify_drift import (
        PLACING_TOLERANCE_MM as PLACING_TOLERANCE_MM,
    )
    from robolink.calibration.quality.verify_drift import verify_drift as verify_drift
    from robolink.calibration.statement.accuracy import assessed as assessed
    from robolink.calibration.statement.accuracy import usual_look_sigma_mm as usual_look_sigma_mm
    from robolink.calibration.statement.sentences import RowInWords as RowInWords
    from robolink.calibration.statement.sentences import accurate_sentence as accurate_sentence
    from robolink.calibration.statement.sentences import basis_words as basis_words
    from robolink.calibration.statement.sentences import (
        largest_row_sentence as largest_row_sentence,
    )
    from robolink.calibration.statement.sentences import measured_axes as measured_axes
    from robolink.calibration.statement.sentences import (
        proved_statements as proved_statements,
    )
    from robolink.calibration.statement.sentences import repeatable_sentence as repeatable_sentence
    from robolink.calibration.statement.sentences import rows_in_words as rows_in_words
    from robolink.calibration.statement.sentences import seating_sentence as seating_sentence
    from robolink.calibration.statement.sentences import stated_mm as stated_mm
    from robolink.calibration.statement.sentences import statement_line as statement_line
    from robolink.calibration.statement.sentences import statement_sentences as statement_sentences
    from robolink.calibration.statement.sentences import (
        turn_test_headline as turn_test_headline,
    )
    from robolink.calibration.statement.sentences import (
        turn_test_sentences as turn_test_sentences,
    )
    from robolink.calibration.statement.turn_test import LEAST_TURN_DEG as LEAST_TURN_DEG
    from robolink.calibration.statement.turn_test import held_to_claim as held_to_claim
    from robolink.calibration.statement.turn_test import turn_claim as turn_claim
    from robolink.calibration.statement.turn_test_again import MOST_REPEATS as MOST_REPEATS
    from robolink.calibration.statement.turn_test_again import held_together as held_together
    from robolink.calibration.statement.turn_test_again import looks_together as looks_together
    from robolink.calibration.touch.length import LengthChange as LengthChange
    from robolink.calibration.touch.length import LengthDecision as LengthDecision
    from robolink.calibration.touch.length import length_change as length_change
    from robolink.calibration.touch.length import length_not_observable as length_not_observable
    from robolink.calibration.touch.plane_touch import PlaneTouchResult as PlaneTouchResult
    from robolink.calibration.touch.plane_touch import TouchedPlane as TouchedPlane
    from robolink.calibration.touch.plane_touch import plane_columns as plane_columns
    from robolink.calibration.touch.plane_touch import solve_plane_touch as solve_plane_touch
    from robolink.calibration.touch.sphere_touch import SphereTouchResult as SphereTouchResult
    from robolink.calibration.touch.sphere_touch import solve_sphere_touch as solve_sphere_touch
    from robolink.calibration.touch.sphere_touch import sphere_columns as sphere_columns
    from robolink.calibration.touch.sphere_touch import sphere_through as sphere_through
    from robolink.calibration.touch.surface_fit import SurfaceEvidence as SurfaceEvidence
    from robolink.calibration.touch.surface_fit import SurfaceStandoffs as SurfaceStandoffs
    from robolink.calibration.touch.surface_fit import (
        judge_surface_touches as judge_surface_touches,
    )
    from robolink.calibration.touch.surface_fit import tip_is_told as tip_is_told
    from robolink.calibration.touch.touch_evidence import Standoff as Standoff
    from robolink.calibration.touch.touch_evidence import StandoffSeries as StandoffSeries
    from robolink.calibration.touch.touch_evidence import TouchEvidence as TouchEvidence
    from robolink.calibration.touch.touch_evidence import WitnessedTouch as WitnessedTouch
    from robolink.calibration.touch.touch_evidence import height_limit_mm as height_limit_mm
    from robolink.calibration.touch.touch_evidence import (
        height_shows_from_mm as height_shows_from_mm,
    )
    from robolink.calibration.touch.touch_evidence import judge_touches as judge_touches
    from robolink.calibration.touch.touch_evidence import least_jog_mm as least_jog_mm
    from robolink.calibration.touch.touch_evidence import stand_upright as stand_upright
    from robolink.calibration.touch.z_touch import (
        USUAL_DECELERATION_MM_S2 as USUAL_DECELERATION_MM_S2,
    )
    from robolink.calibration.touch.z_touch import Touch as Touch
    from robolink.calibration.touch.z_touch import ZTouchResult as ZTouchResult
    from robolink.calibration.touch.z_touch import solve_z_touch as solve_z_touch
    from robolink.calibration.touch.z_touch import touch_sigma_gain as touch_sigma_gain
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "beam_lines": "Beam Crossing Lean ShaftSeen find_beams",
            "camera.board": "BoardDrawing LEAST_SPACING_MM solve_board",
            "camera.board_fit": "solve_board_fit solve_board_round",
            "camera.camera_affine": "CameraCalibration PixelSighting solve_camera_affine",
            "camera.camera_model": (
                "CameraLimits CameraModel Sighting USUAL_CAMERA require_same_camera"
            ),
            "camera.camera_round": "CameraRound as_round solve_camera_round",
            "camera.known_movement": (
                "CameraChangeRows MovementVerdict SeenMovement camera_changed "
                "mm_camera_noise same_radius spot_changed tip_did_not_move"
            ),
            "camera.runout": (
                "RunoutReport RunoutRow RunoutTable RunoutTableResult runout_report "
                "solve_runout_table"
            ),
            "camera.up_camera": "solve_up_camera",
            "core.accuracy": (
                "ACCURACY_ROWS Accuracy AccuracyFacts AccuracyRow AssessedRow BudgetRow "
                "DIVISORS ErrorSource RowFact UncertaintyBudget"
            ),
            "core.dispersion": "require_positive",
            "core.frames": (
                "flange_of flange_pose flange_poses in_base seen_from "
                "tilted_flange_pose tilted_from tip_pose toward_zero"
            ),
            "core.least_squares": "Floats Robust linear_fit",
            "core.pose_checks": "MIN_ROTATION_DEG angle_spread_deg planar_sigma_gain",
            "core.pose_suggestion": (
                "PoseLimits PosePlan precise_enough select_poses sigma_gain suggest_poses"
            ),
            "core.result": (
                "CalibrationResult Drift DriftVerdict FitEvidence GUARD_FACTOR "
                "LEAST_HALF_WIDTH PERSON_U_DRIFT_MM ResidualVectors RunOrder "
                "VerifyResult judge_drift offset_sigma_mm worst_of"
            ),
            "core.rotations": (
                "pose_arrays quaternion_rotations rotation_of rotations uvw_deg zyz_deg"
            ),
            "core.statistics": (
                "NORMAL_95 chi_square_quantile f_exceeded f_quantile normal_quantile "
                "shifted_half95 shifted_region95 student_t studentized_range_0999"
            ),
            "core.turn_claim": (
                "CONTRADICTS_ACCURACY CONTRADICTS_REPEATABILITY DriftLimits REPEATED "
                "SMALL_ANGLE TurnClaim TurnJudgement"
            ),
            "crossed_beams": (
                "BeamsResult crossing_sigma_gain moved_beams solve_crossed_beams where_they_cross"
            ),
            "flange_plane": "FlangePlane TipHeight carrying height_of solvable_planes",
            "pin.joint": "JointResult JointTouch ToolDifference solve_joint",
            "pin.n_angle": "solve_n_angle",
            "pin.needle_chain": "NeedleChain NeedleLimits StoredZ chain_of chain_sigma_mm",
            "pin.needle_change": "NeedleChangeResult solve_needle_change",
            "pin.one_touch": "Pin pin_touched solve_one_touch",
            "pin.pivot": (
                "PivotDesign PivotFit fit_pivot fit_pivot_robust pivot_design solve_pivot"
            ),
            "pin.six_point": (
                "FAR_DEG GOOD_WAY_MM SixPointResult ToolAxis axis_displacement "
                "between_deg require_unturned solve_six_point solve_tool_axis"
            ),
            "pin.two_pose": "solve_two_pose two_of",
            "quality.control_chart": (
                "ControlChart LEAST_BASELINE USUAL_LAMBDA USUAL_WIDTH control_chart"
            ),
            "quality.doubts": (
                "BEYOND_TOLERANCE FARTHEST_MM HIGHEST_MM MOST_RESIDUAL_MM "
                "PERSON_SIGMA_Z_MM PLANAR_TOLERANCE PROBE_SIGMA_Z_MM TOUCH_TOLERANCE "
                "Tolerance beyond_tolerance doubt_sentence known_doubts order_in_words"
            ),
            "quality.gauge_study": "GaugeStudy gauge_study",
            "quality.given_poses": (
                "RobotReach ToolFit better_fit fits_alike require_near "
                "require_stored_scale require_within_reach tool_fits"
            ),
            "quality.offset_change": (
                "Correction Impact NEEDLE_LIMIT_MM PointImpact impact_on "
                "require_shrinking update_guard writes_refused_unattended"
            ),
            "quality.pose_evidence": "with_approach_bias",
            "quality.station": (
                "SharedStation StationPart StationShift TipShift judge_shifts "
                "shared_station with_station"
            ),
            "quality.verify_drift": "PLACING_TOLERANCE_MM verify_drift",
            "statement.accuracy": "assessed usual_look_sigma_mm",
            "statement.sentences": (
                "RowInWords accurate_sentence basis_words largest_row_sentence "
                "measured_axes proved_statements repeatable_sentence rows_in_words "
                "seating_sentence stated_mm statement_line statement_sentences "
                "turn_test_headline turn_test_sentences"
            ),
            "statement.turn_test": "LEAST_TURN_DEG held_to_claim turn_claim",
            "statement.turn_test_again": "MOST_REPEATS held_together looks_together",
            "touch.length": "LengthChange LengthDecision length_change length_not_observable",
            "touch.plane_touch": "PlaneTouchResult TouchedPlane plane_columns solve_plane_touch",
            "touch.sphere_touch": (
                "SphereTouchResult solve_sphere_touch sphere_columns sphere_through"
            ),
            "touch.surface_fit": (
                "SurfaceEvidence SurfaceStandoffs judge_surface_touches tip_is_told"
            ),
            "touch.touch_evidence": (
                "Standoff StandoffSeries TouchEvidence WitnessedTouch height_limit_mm "
                "height_shows_from_mm judge_touches least_jog_mm stand_upright"
            ),
            "touch.z_touch": (
                "Touch USUAL_DECELERATION_MM_S2 ZTouchResult solve_z_touch touch_sigma_gain"
            ),
        },
    )
