"""What calibration methods share: ways to a place, touches of a pin, looks of a camera, sampling.

A procedure is a generator of steps (:mod:`robolink.runner`); a source runs procedures for one tool.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names
from robolink.procedures.approach import (
    NO_OFFSET,
    approach_path,
    offset_z,
    require_turn_inside,
    seek_or_retract,
    turn_in_air,
)
from robolink.procedures.camera_drive import (
    HALF_ROUND_DEG,
    LEAST_BESIDE_MM,
    TWO_ANGLES_DEG,
    CameraDrive,
    LookPlan,
    Place,
)
from robolink.procedures.camera_looks import (
    NO_ERROR,
    CameraSamples,
    look_again,
    nearest_first,
    seen_drift,
    verify_by_looking,
)
from robolink.procedures.kept_proof import (
    KeepsProof,
    KeptProof,
    PlacedProof,
    ProofBasis,
    ProvesAgain,
)
from robolink.procedures.pin_proof import (
    MOST_MORE,
    DriftProof,
    TurnTest,
    contact_pose,
    drift_uncertainty_mm,
    verify_by_turning,
)
from robolink.procedures.pin_touches import PinTouches, lift_off, touch_again, turned_touches
from robolink.procedures.sample_sequence import (
    TAKE_ALL,
    SamplingPolicy,
    agreement,
    finalize_samples,
    may_end_early,
    resume_samples,
    sample_sequentially,
)
from robolink.procedures.samples import Sampler, Samples, SequentialSampler
from robolink.procedures.source import (
    FindsStation,
    MeasurementContext,
    MovingSource,
    PoseMethod,
    RequiresMotion,
    RequiresSensor,
    StopsAbovePin,
    TipSource,
    TouchesFurther,
)
from robolink.procedures.source_bases import (
    InputSource,
    LazySource,
    LookSource,
    ManualPinSource,
    PinSource,
    TouchesPin,
    TouchSource,
    angles_between,
    calibrated_camera,
    camera_error_of,
    middles_of_gaps,
    pixel_camera,
    proof_angles,
    radius_of,
    touches_of,
)
from robolink.procedures.surface_touches import SurfaceTouches
from robolink.procedures.tilt_proof import SurfaceProof
from robolink.procedures.witnessed_touches import (
    TOUCH_CODES,
    TouchPlan,
    heights_agree,
    jog_mm,
    plain_pose,
    require_one_height,
    require_touches,
)

__all__ = [
    "CameraDrive",
    "CameraSamples",
    "DriftProof",
    "FindsStation",
    "HALF_ROUND_DEG",
    "InputSource",
    "KeepsProof",
    "KeptProof",
    "LEAST_BESIDE_MM",
    "LazySource",
    "LookPlan",
    "LookSource",
    "MOST_MORE",
    "ManualPinSource",
    "MeasurementContext",
    "MovingSource",
    "NO_ERROR",
    "NO_OFFSET",
    "PinSource",
    "PinTouches",
    "Place",
    "PlacedProof",
    "PoseMethod",
    "ProofBasis",
    "ProvesAgain",
    "RequiresMotion",
    "RequiresSensor",
    "Sampler",
    "Samples",
    "SamplingPolicy",
    "SequentialSampler",
    "StopsAbovePin",
    "SurfaceProof",
    "SurfaceTouches",
    "TAKE_ALL",
    "TOUCH_CODES",
    "TWO_ANGLES_DEG",
    "TipSource",
    "TouchPlan",
    "TouchSource",
    "TouchesFurther",
    "TouchesPin",
    "TurnTest",
    "agreement",
    "angles_between",
    "approach_path",
    "calibrated_camera",
    "camera_error_of",
    "contact_pose",
    "drift_uncertainty_mm",
    "finalize_samples",
    "heights_agree",
    "jog_mm",
    "lift_off",
    "look_again",
    "may_end_early",
    "middles_of_gaps",
    "nearest_first",
    "offset_z",
    "pixel_camera",
    "plain_pose",
    "proof_angles",
    "radius_of",
    "require_one_height",
    "require_touches",
    "require_turn_inside",
    "resume_samples",
    "sample_sequentially",
    "seek_or_retract",
    "seen_drift",
    "touch_again",
    "touches_of",
    "turn_in_air",
    "turned_touches",
    "verify_by_looking",
    "verify_by_turning",
]

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
