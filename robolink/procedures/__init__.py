"""What calibration methods share: paths to a place, touches of a pin, looks, sampling.

A procedure is a generator of steps (:mod:`robolink.runner`); a source runs procedures for one tool.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports, old_names

if TYPE_CHECKING:
    from robolink.procedures.approach import NO_OFFSET as NO_OFFSET
    from robolink.procedures.approach import approach_path as approach_path
    from robolink.procedures.approach import offset_z as offset_z
    from robolink.procedures.approach import require_turn_inside as require_turn_inside
    from robolink.procedures.approach import seek_or_retract as seek_or_retract
    from robolink.procedures.approach import turn_in_air as turn_in_air
    from robolink.procedures.camera_drive import HALF_ROUND_DEG as HALF_ROUND_DEG
    from robolink.procedures.camera_drive import LEAST_BESIDE_MM as LEAST_BESIDE_MM
    from robolink.procedures.camera_drive import TWO_ANGLES_DEG as TWO_ANGLES_DEG
    from robolink.procedures.camera_drive import CameraDrive as CameraDrive
    from robolink.procedures.camera_drive import LookPlan as LookPlan
    from robolink.procedures.camera_drive import Place as Place
    from robolink.procedures.camera_looks import NO_ERROR as NO_ERROR
    from robolink.procedures.camera_looks import CameraSamples as CameraSamples
    from robolink.procedures.camera_looks import nearest_first as nearest_first
    from robolink.procedures.camera_looks import seen_drift as seen_drift
    from robolink.procedures.camera_looks import verify_by_looking as verify_by_looking
    from robolink.procedures.kept_proof import KeepsProof as KeepsProof
    from robolink.procedures.kept_proof import KeptProof as KeptProof
    from robolink.procedures.kept_proof import PlacedProof as PlacedProof
    from robolink.procedures.kept_proof import ProofBasis as ProofBasis
    from robolink.procedures.kept_proof import ProvesAgain as ProvesAgain
    from robolink.procedures.pin_proof import MOST_MORE as MOST_MORE
    from robolink.procedures.pin_proof import DriftProof as DriftProof
    from robolink.procedures.pin_proof import TurnTest as TurnTest
    from robolink.procedures.pin_proof import contact_pose as contact_pose
    from robolink.procedures.pin_proof import drift_uncertainty_mm as drift_uncertainty_mm
    from robolink.procedures.pin_proof import verify_by_turning as verify_by_turning
    from robolink.procedures.pin_touches import PinTouches as PinTouches
    from robolink.procedures.pin_touches import lift_off as lift_off
    from robolink.procedures.pin_touches import touch_again as touch_again
    from robolink.procedures.pin_touches import turned_touches as turned_touches
    from robolink.procedures.sample_sequence import TAKE_ALL as TAKE_ALL
    from robolink.procedures.sample_sequence import SamplingPolicy as SamplingPolicy
    from robolink.procedures.sample_sequence import agreement as agreement
    from robolink.procedures.sample_sequence import finalize_samples as finalize_samples
    from robolink.procedures.sample_sequence import may_end_early as may_end_early
    from robolink.procedures.sample_sequence import resume_samples as resume_samples
    from robolink.procedures.sample_sequence import sample_sequentially as sample_sequentially
    from robolink.procedures.samples import Sampler as Sampler
    from robolink.procedures.samples import Samples as Samples
    from robolink.procedures.samples import SequentialSampler as SequentialSampler
    from robolink.procedures.source import FindsStation as FindsStation
    from robolink.procedures.source import MeasurementContext as MeasurementContext
    from robolink.procedures.source import MovingSource as MovingSource
    from robolink.procedures.source import PoseMethod as PoseMethod
    from robolink.procedures.source import RequiresMotion as RequiresMotion
    from robolink.procedures.source import RequiresSensor as RequiresSensor
    from robolink.procedures.source import StopsAbovePin as StopsAbovePin
    from robolink.procedures.source import TipSource as TipSource
    from robolink.procedures.source import TouchesFurther as TouchesFurther
    from robolink.procedures.source_bases import InputSource as InputSource
    from robolink.procedures.source_bases import LazySource as LazySource
    from robolink.procedures.source_bases import LookSource as LookSource
    from robolink.procedures.source_bases import ManualPinSource as ManualPinSource
    from robolink.procedures.source_bases import PinSource as PinSource
    from robolink.procedures.source_bases import TouchesPin as TouchesPin
    from robolink.procedures.source_bases import TouchSource as TouchSource
    from robolink.procedures.source_bases import angles_between as angles_between
    from robolink.procedures.source_bases import calibrated_camera as calibrated_camera
    from robolink.procedures.source_bases import camera_error_of as camera_error_of
    from robolink.procedures.source_bases import middles_of_gaps as middles_of_gaps
    from robolink.procedures.source_bases import pixel_camera as pixel_camera
    from robolink.procedures.source_bases import proof_angles as proof_angles
    from robolink.procedures.source_bases import radius_of as radius_of
    from robolink.procedures.source_bases import touches_of as touches_of
    from robolink.procedures.surface_touches import SurfaceTouches as SurfaceTouches
    from robolink.procedures.tilt_proof import SurfaceProof as SurfaceProof
    from robolink.procedures.witnessed_touches import TOUCH_CODES as TOUCH_CODES
    from robolink.procedures.witnessed_touches import TouchPlan as TouchPlan
    from robolink.procedures.witnessed_touches import heights_agree as heights_agree
    from robolink.procedures.witnessed_touches import jog_mm as jog_mm
    from robolink.procedures.witnessed_touches import plain_pose as plain_pose
    from robolink.procedures.witnessed_touches import require_one_height as require_one_height
    from robolink.procedures.witnessed_touches import require_touches as require_touches
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "approach": (
                "NO_OFFSET approach_path offset_z require_turn_inside seek_or_retract turn_in_air"
            ),
            "camera_drive": (
                "CameraDrive HALF_ROUND_DEG LEAST_BESIDE_MM LookPlan Place TWO_ANGLES_DEG"
            ),
            "camera_looks": ("CameraSamples NO_ERROR nearest_first seen_drift verify_by_looking"),
            "kept_proof": "KeepsProof KeptProof PlacedProof ProofBasis ProvesAgain",
            "pin_proof": (
                "DriftProof MOST_MORE TurnTest contact_pose drift_uncertainty_mm verify_by_turning"
            ),
            "pin_touches": "PinTouches lift_off touch_again turned_touches",
            "sample_sequence": (
                "SamplingPolicy TAKE_ALL agreement finalize_samples may_end_early "
                "resume_samples sample_sequentially"
            ),
            "samples": "Sampler Samples SequentialSampler",
            "source": (
                "FindsStation MeasurementContext MovingSource PoseMethod RequiresMotion "
                "RequiresSensor StopsAbovePin TipSource TouchesFurther"
            ),
            "source_bases": (
                "InputSource LazySource LookSource ManualPinSource PinSource "
                "TouchSource TouchesPin angles_between calibrated_camera "
                "camera_error_of middles_of_gaps pixel_camera proof_angles radius_of "
                "touches_of"
            ),
            "surface_touches": "SurfaceTouches",
            "tilt_proof": "SurfaceProof",
            "witnessed_touches": (
                "TOUCH_CODES TouchPlan heights_agree jog_mm plain_pose "
                "require_one_height require_touches"
            ),
        },
        old_names(__name__),
    )
