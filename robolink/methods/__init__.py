"""The calibration methods: how each measures, solves and tests."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.methods.beams import BeamLine as BeamLine
    from robolink.methods.beams import BeamsParameters as BeamsParameters
    from robolink.methods.beams import BeamsSource as BeamsSource
    from robolink.methods.beams import measure_beams as measure_beams
    from robolink.methods.beams.procedure import trace_beams as trace_beams
    from robolink.methods.beams.procedure import verify_by_crossing as verify_by_crossing
    from robolink.methods.board import BoardParameters as BoardParameters
    from robolink.methods.board import BoardSource as BoardSource
    from robolink.methods.board import measure_board as measure_board
    from robolink.methods.board import verify_board as verify_board
    from robolink.methods.camera import CameraParameters as CameraParameters
    from robolink.methods.camera import CameraSource as CameraSource
    from robolink.methods.camera import measure_camera as measure_camera
    from robolink.methods.camera_affine import LEAST_SPAN_MM as LEAST_SPAN_MM
    from robolink.methods.camera_affine import CameraAffineParameters as CameraAffineParameters
    from robolink.methods.camera_affine import CameraAffineSource as CameraAffineSource
    from robolink.methods.camera_affine import measure_camera_affine as measure_camera_affine
    from robolink.methods.given_poses import PointsSource as PointsSource
    from robolink.methods.given_poses import PosesFound as PosesFound
    from robolink.methods.given_poses import taught_poses as taught_poses
    from robolink.methods.method import DEGREES as DEGREES
    from robolink.methods.method import MM as MM
    from robolink.methods.method import MM_S as MM_S
    from robolink.methods.method import NOTHING_STATED as NOTHING_STATED
    from robolink.methods.method import Angle as Angle
    from robolink.methods.method import AnyMethod as AnyMethod
    from robolink.methods.method import Check as Check
    from robolink.methods.method import Former as Former
    from robolink.methods.method import Help as Help
    from robolink.methods.method import InputNumber as InputNumber
    from robolink.methods.method import Length as Length
    from robolink.methods.method import LengthRule as LengthRule
    from robolink.methods.method import Method as Method
    from robolink.methods.method import MethodParameters as MethodParameters
    from robolink.methods.method import Needs as Needs
    from robolink.methods.method import NextStep as NextStep
    from robolink.methods.method import Option as Option
    from robolink.methods.method import Pair as Pair
    from robolink.methods.method import PoseHelp as PoseHelp
    from robolink.methods.method import Site as Site
    from robolink.methods.method import StatedLimits as StatedLimits
    from robolink.methods.method import ToolHistory as ToolHistory
    from robolink.methods.method import Unit as Unit
    from robolink.methods.n_angle import ManyTouches as ManyTouches
    from robolink.methods.n_angle import NAngleParameters as NAngleParameters
    from robolink.methods.n_angle import NAngleSource as NAngleSource
    from robolink.methods.n_angle import measure_n_angle as measure_n_angle
    from robolink.methods.n_angle import most_informative_order as most_informative_order
    from robolink.methods.one_touch import OneTouchParameters as OneTouchParameters
    from robolink.methods.one_touch import OneTouchSource as OneTouchSource
    from robolink.methods.one_touch import measure_one_touch as measure_one_touch
    from robolink.methods.one_touch.solvers import KEPT as KEPT
    from robolink.methods.one_touch.solvers import Absolute as Absolute
    from robolink.methods.one_touch.solvers import Difference as Difference
    from robolink.methods.one_touch.solvers import LastTouch as LastTouch
    from robolink.methods.one_touch.solvers import difference_from_last as difference_from_last
    from robolink.methods.one_touch.solvers import find_last_touch as find_last_touch
    from robolink.methods.parameter_checks import ParameterField as ParameterField
    from robolink.methods.parameter_checks import fields_of as fields_of
    from robolink.methods.parameter_checks import order_of_residuals as order_of_residuals
    from robolink.methods.parameter_checks import parameter_problems as parameter_problems
    from robolink.methods.parameter_checks import source_of as source_of
    from robolink.methods.pivot import PivotParameters as PivotParameters
    from robolink.methods.pivot import PivotSource as PivotSource
    from robolink.methods.pivot import PivotTouches as PivotTouches
    from robolink.methods.pivot import measure_pivot as measure_pivot
    from robolink.methods.pivot import require_tilting as require_tilting
    from robolink.methods.pivot.procedure import verify_by_tilting as verify_by_tilting
    from robolink.methods.pivot.six_point import AxisTeachPlan as AxisTeachPlan
    from robolink.methods.pivot.six_point import SixPointParameters as SixPointParameters
    from robolink.methods.pivot.six_point import SixPoints as SixPoints
    from robolink.methods.pivot.six_point import SixPointSource as SixPointSource
    from robolink.methods.pivot.six_point import measure_six_point as measure_six_point
    from robolink.methods.pivot.tilts import OverPin as OverPin
    from robolink.methods.pivot.tilts import Tilt as Tilt
    from robolink.methods.pivot.tilts import informative_tilts as informative_tilts
    from robolink.methods.pivot.tilts import proving_tilts as proving_tilts
    from robolink.methods.points import PointsParameters as PointsParameters
    from robolink.methods.registry import METHODS_GROUP as METHODS_GROUP
    from robolink.methods.registry import all_methods as all_methods
    from robolink.methods.registry import find_method as find_method
    from robolink.methods.registry import method_names as method_names
    from robolink.methods.registry import register as register
    from robolink.methods.runout_table import AllRoundPlan as AllRoundPlan
    from robolink.methods.runout_table import RunoutTableParameters as RunoutTableParameters
    from robolink.methods.runout_table import RunoutTableSource as RunoutTableSource
    from robolink.methods.runout_table import measure_runout_table as measure_runout_table
    from robolink.methods.shared_parameters import LookParameters as LookParameters
    from robolink.methods.shared_parameters import PinParameters as PinParameters
    from robolink.methods.shared_parameters import UprightPinParameters as UprightPinParameters
    from robolink.methods.station_reference import learn_station as learn_station
    from robolink.methods.surface_touch import SurfaceParameters as SurfaceParameters
    from robolink.methods.surface_touch.plane import PlaneTouches as PlaneTouches
    from robolink.methods.surface_touch.plane import PlaneTouchParameters as PlaneTouchParameters
    from robolink.methods.surface_touch.plane import PlaneTouchSource as PlaneTouchSource
    from robolink.methods.surface_touch.plane import measure_plane_touch as measure_plane_touch
    from robolink.methods.surface_touch.sphere import SphereTouches as SphereTouches
    from robolink.methods.surface_touch.sphere import SphereTouchParameters as SphereTouchParameters
    from robolink.methods.surface_touch.sphere import SphereTouchSource as SphereTouchSource
    from robolink.methods.surface_touch.sphere import measure_sphere_touch as measure_sphere_touch
    from robolink.methods.surface_touch.survey import PlaneSurvey as PlaneSurvey
    from robolink.methods.surface_touch.survey import SphereSurvey as SphereSurvey
    from robolink.methods.two_pose import TwoPoseParameters as TwoPoseParameters
    from robolink.methods.two_pose import TwoPoseSource as TwoPoseSource
    from robolink.methods.two_pose import TwoTouches as TwoTouches
    from robolink.methods.two_pose import measure_two_pose as measure_two_pose
    from robolink.methods.z_touch import ZTouchParameters as ZTouchParameters
    from robolink.methods.z_touch import ZTouchSource as ZTouchSource
    from robolink.methods.z_touch import measure_z_touch as measure_z_touch
    from robolink.methods.z_touch.procedure import verify_by_touching as verify_by_touching
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "beams": "BeamLine BeamsParameters BeamsSource measure_beams",
            "beams.procedure": "trace_beams verify_by_crossing",
            "board": "BoardParameters BoardSource measure_board verify_board",
            "camera": "CameraParameters CameraSource measure_camera",
            "camera_affine": (
                "CameraAffineParameters CameraAffineSource LEAST_SPAN_MM measure_camera_affine"
            ),
            "given_poses": "PointsSource PosesFound taught_poses",
            "method": (
                "Angle AnyMethod Check DEGREES Former Help InputNumber Length "
                "LengthRule MM MM_S Method MethodParameters NOTHING_STATED Needs "
                "NextStep Option Pair PoseHelp Site StatedLimits ToolHistory Unit"
            ),
            "n_angle": (
                "ManyTouches NAngleParameters NAngleSource measure_n_angle most_informative_order"
            ),
            "one_touch": "OneTouchParameters OneTouchSource measure_one_touch",
            "one_touch.solvers": (
                "Absolute Difference KEPT LastTouch difference_from_last find_last_touch"
            ),
            "parameter_checks": (
                "ParameterField fields_of order_of_residuals parameter_problems source_of"
            ),
            "pivot": "PivotParameters PivotSource PivotTouches measure_pivot require_tilting",
            "pivot.procedure": "verify_by_tilting",
            "pivot.six_point": (
                "AxisTeachPlan SixPointParameters SixPointSource SixPoints measure_six_point"
            ),
            "pivot.tilts": "OverPin Tilt informative_tilts proving_tilts",
            "points": "PointsParameters",
            "registry": "METHODS_GROUP all_methods find_method method_names register",
            "runout_table": (
                "AllRoundPlan RunoutTableParameters RunoutTableSource measure_runout_table"
            ),
            "shared_parameters": "LookParameters PinParameters UprightPinParameters",
            "station_reference": "learn_station",
            "surface_touch": "SurfaceParameters",
            "surface_touch.plane": (
                "PlaneTouchParameters PlaneTouchSource PlaneTouches measure_plane_touch"
            ),
            "surface_touch.sphere": (
                "SphereTouchParameters SphereTouchSource SphereTouches measure_sphere_touch"
            ),
            "surface_touch.survey": "PlaneSurvey SphereSurvey",
            "two_pose": "TwoPoseParameters TwoPoseSource TwoTouches measure_two_pose",
            "z_touch": "ZTouchParameters ZTouchSource measure_z_touch",
            "z_touch.procedure": "verify_by_touching",
        },
    )
