"""What calibration methods share: ways to a place, touches of a pin, looks of a camera, sampling.

A procedure is a generator of steps (:mod:`robolink.runner`); a source runs procedures for one tool.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.procedures.approach import NO_OFFSET as NO_OFFSET
    from robolink.procedures.approach import approach_path as approach_path
    from robolink.procedures.approach import offset_z as offset_z
    from robolink.procedures.approach import seek_or_retract as seek_or_retract
    from robolink.procedures.camera.drive import CameraDrive as CameraDrive
    from robolink.procedures.camera.drive import Place as Place
    from robolink.procedures.camera.plan import HALF_ROUND_DEG as HALF_ROUND_DEG
    from robolink.procedures.camera.plan import LEAST_BESIDE_MM as LEAST_BESIDE_MM
    from robolink.procedures.camera.plan import TWO_ANGLES_DEG as TWO_ANGLES_DEG
    from robolink.procedures.camera.plan import LookPlan as LookPlan
    from robolink.procedures.camera.samples import CameraSamples as CameraSamples
    from robolink.procedures.camera.source import CalibratedCameraSource as CalibratedCameraSource
    from robolink.procedures.camera.source import angles_between as angles_between
    from robolink.procedures.camera.source import calibrated_camera as calibrated_camera
    from robolink.procedures.camera.source import camera_error_of as camera_error_of
    from robolink.procedures.camera.source import pixel_camera as pixel_camera
    from robolink.procedures.camera.source import proof_angles as proof_angles
    from robolink.procedures.camera.source import radius_of as radius_of
    from robolink.procedures.camera.verify import NO_ERROR as NO_ERROR
    from robolink.procedures.camera.verify import nearest_first as nearest_first
    from robolink.procedures.camera.verify import seen_drift as seen_drift
    from robolink.procedures.camera.verify import verify_by_looking as verify_by_looking
    from robolink.procedures.input_source import InputSource as InputSource
    from robolink.procedures.lazy_source import LazySource as LazySource
    from robolink.procedures.pin.judging import TOUCH_CODES as TOUCH_CODES
    from robolink.procedures.pin.judging import heights_agree as heights_agree
    from robolink.procedures.pin.judging import jog_mm as jog_mm
    from robolink.procedures.pin.judging import require_one_height as require_one_height
    from robolink.procedures.pin.judging import require_touches as require_touches
    from robolink.procedures.pin.proof import MOST_MORE as MOST_MORE
    from robolink.procedures.pin.proof import DriftProof as DriftProof
    from robolink.procedures.pin.proof import contact_pose as contact_pose
    from robolink.procedures.pin.proof import drift_uncertainty_mm as drift_uncertainty_mm
    from robolink.procedures.pin.proof import verify_by_turning as verify_by_turning
    from robolink.procedures.pin.source import ManualPinSource as ManualPinSource
    from robolink.procedures.pin.source import PinSource as PinSource
    from robolink.procedures.pin.source import TouchesPin as TouchesPin
    from robolink.procedures.pin.source import TouchSource as TouchSource
    from robolink.procedures.pin.source import middles_of_gaps as middles_of_gaps
    from robolink.procedures.pin.source import touches_of as touches_of
    from robolink.procedures.pin.touch_plan import TouchPlan as TouchPlan
    from robolink.procedures.pin.touch_plan import plain_pose as plain_pose
    from robolink.procedures.pin.touches import PinTouches as PinTouches
    from robolink.procedures.pin.touches import lift_off as lift_off
    from robolink.procedures.pin.touches import touch_again as touch_again
    from robolink.procedures.pin.touches import turned_touches as turned_touches
    from robolink.procedures.pin.turn_test import TurnTest as TurnTest
    from robolink.procedures.pose_method import PoseMethod as PoseMethod
    from robolink.procedures.proving.kept_proof import KeepsProof as KeepsProof
    from robolink.procedures.proving.kept_proof import KeptProof as KeptProof
    from robolink.procedures.proving.kept_proof import PlacedProof as PlacedProof
    from robolink.procedures.proving.kept_proof import ProvesAgain as ProvesAgain
    from robolink.procedures.sampling.sampler import Sampler as Sampler
    from robolink.procedures.sampling.sampler import SequentialSampler as SequentialSampler
    from robolink.procedures.sampling.samples import Samples as Samples
    from robolink.procedures.sampling.sequential import TAKE_ALL as TAKE_ALL
    from robolink.procedures.sampling.sequential import SamplingPolicy as SamplingPolicy
    from robolink.procedures.sampling.sequential import agreement as agreement
    from robolink.procedures.sampling.sequential import finalize_samples as finalize_samples
    from robolink.procedures.sampling.sequential import may_end_early as may_end_early
    from robolink.procedures.sampling.sequential import resume_samples as resume_samples
    from robolink.procedures.sampling.sequential import sample_sequentially as sample_sequentially
    from robolink.procedures.source import FindsStation as FindsStation
    from robolink.procedures.source import MeasurementContext as MeasurementContext
    from robolink.procedures.source import MovingSource as MovingSource
    from robolink.procedures.source import RequiresMotion as RequiresMotion
    from robolink.procedures.source import RequiresSensor as RequiresSensor
    from robolink.procedures.source import StopsAbovePin as StopsAbovePin
    from robolink.procedures.source import TipSource as TipSource
    from robolink.procedures.source import TouchesFurther as TouchesFurther
    from robolink.procedures.surface_proof import SurfaceProof as SurfaceProof
    from robolink.procedures.surface_touches import SurfaceTouches as SurfaceTouches
    from robolink.procedures.turning import require_turn_inside as require_turn_inside
    from robolink.procedures.turning import turn_in_air as turn_in_air
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "approach": "NO_OFFSET approach_path offset_z seek_or_retract",
            "camera.drive": "CameraDrive Place",
            "camera.plan": "HALF_ROUND_DEG LEAST_BESIDE_MM LookPlan TWO_ANGLES_DEG",
            "camera.samples": "CameraSamples",
            "camera.source": (
                "CalibratedCameraSource angles_between calibrated_camera "
                "camera_error_of pixel_camera proof_angles radius_of"
            ),
            "camera.verify": "NO_ERROR nearest_first seen_drift verify_by_looking",
            "input_source": "InputSource",
            "lazy_source": "LazySource",
            "pin.judging": "TOUCH_CODES heights_agree jog_mm require_one_height require_touches",
            "pin.proof": (
                "DriftProof MOST_MORE contact_pose drift_uncertainty_mm verify_by_turning"
            ),
            "pin.source": (
                "ManualPinSource PinSource TouchSource TouchesPin middles_of_gaps touches_of"
            ),
            "pin.touch_plan": "TouchPlan plain_pose",
            "pin.touches": "PinTouches lift_off touch_again turned_touches",
            "pin.turn_test": "TurnTest",
            "pose_method": "PoseMethod",
            "proving.kept_proof": "KeepsProof KeptProof PlacedProof ProvesAgain",
            "sampling.sampler": "Sampler SequentialSampler",
            "sampling.samples": "Samples",
            "sampling.sequential": (
                "SamplingPolicy TAKE_ALL agreement finalize_samples "
                "may_end_early resume_samples sample_sequentially"
            ),
            "source": (
                "FindsStation MeasurementContext MovingSource RequiresMotion "
                "RequiresSensor StopsAbovePin TipSource TouchesFurther"
            ),
            "surface_proof": "SurfaceProof",
            "surface_touches": "SurfaceTouches",
            "turning": "require_turn_inside turn_in_air",
        },
    )
