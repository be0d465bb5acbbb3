"""The parameters of camera-affine."""

from dataclasses import dataclass
from typing import Annotated, Final

from annotated_types import Ge, Le

from robolink.calibration import USUAL_CAMERA, CameraLimits
from robolink.messages import declared
from robolink.methods.declaration.look_parameters import LookParameters
from robolink.methods.declaration.method import DEGREES, MM, Help, Option, Pair, Rows

LEAST_SPAN_MM: Final = 0.2
"""A smaller pattern does not tell what a pixel is."""


@dataclass(frozen=True, kw_only=True)
class CameraAffineParameters(LookParameters):
    """The pattern that finds a camera and an offset together."""

    span_mm: Annotated[
        float,
        Ge(LEAST_SPAN_MM),
        Le(50),
        MM,
        Help(declared("How far the tip goes from the middle of the image, in X and in Y.")),
    ] = 3.0
    new_camera: Annotated[
        bool,
        Help(
            declared("Camera, lens or mount was changed: do not compare with the last calibration.")
        ),
    ] = False
    mm_per_px: Annotated[
        Rows | None,
        MM,
        Option(flag="--mm-per-px", metavar="XX,XY,YX,YY", moves=False),
        Help(
            declared(
                "What a pixel was in the base when the camera was last found; a camera that "
                "differs is refused. Without it the station's record counts; without a record "
                "nothing is compared."
            )
        ),
    ] = None
    origin_mm: Annotated[
        Pair | None,
        MM,
        Option(metavar="X,Y", moves=False),
        Help(
            declared("Base point that was seen at pixel (0, 0) then; goes with what a pixel was.")
        ),
    ] = None

    shear_limit_deg: Annotated[
        float,
        Ge(1),
        Le(60),
        DEGREES,
        Option(flag="--shear-limit", moves=False),
        Help(declared("Largest angle by which the image may be askew; above 10 it is a doubt.")),
    ] = USUAL_CAMERA.most_shear_deg
    unequal_limit: Annotated[
        float,
        Ge(0.01),
        Le(1),
        Option(flag="--unequal-limit", metavar="SHARE", moves=False),
        Help(
            declared(
                "Largest share by which the scales of the image's axes may differ; above 0.05 it "
                "is a doubt."
            )
        ),
    ] = USUAL_CAMERA.most_unequal_scale
    residual_limit_px: Annotated[
        float,
        Ge(0.1),
        Le(50),
        Option(flag="--residual-limit", metavar="PX", moves=False),
        Help(
            declared(
                "Largest root mean square by which the looks may differ from the camera that is "
                "found, in pixels; above 0.5 it is a doubt."
            )
        ),
    ] = USUAL_CAMERA.most_rms_px
    interval_limit_mm: Annotated[
        float,
        Ge(0.001),
        Le(1),
        MM,
        Option(flag="--interval-limit", moves=False),
        Help(declared("Largest half 95 % interval of X or Y with which a camera is found.")),
    ] = USUAL_CAMERA.interval_mm
    pixel_limit_mm: Annotated[
        float,
        Ge(0.0001),
        Le(1),
        MM,
        Option(flag="--pixel-limit", moves=False),
        Help(declared("Greatest length of a pixel in the base.")),
    ] = USUAL_CAMERA.most_mm_per_px

    @property
    def limits(self) -> CameraLimits:
        """What is refused, for the solver."""
        return CameraLimits(
            most_shear_deg=self.shear_limit_deg,
            most_unequal_scale=self.unequal_limit,
            most_rms_px=self.residual_limit_px,
            interval_mm=self.interval_limit_mm,
            most_mm_per_px=self.pixel_limit_mm,
        )

    @property
    def corners_deg(self) -> tuple[float, ...]:
        """Angles of the corners of the pattern, which are looked at without a turn."""
        return (0.0,)

    @property
    def places(self) -> tuple[tuple[float, float, float], ...]:
        """Every look: X and Y from the middle in mm, turn in degrees."""
        span = self.span_mm
        cross = ((-span, -span), (span, -span), (span, span), (-span, span))
        return (*((dx, dy, 0.0) for dx, dy in cross), *((0.0, 0.0, t) for t in self.turns_deg))
