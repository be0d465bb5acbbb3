"""The parameters of camera-affine."""

from dataclasses import dataclass
from typing import Annotated, Final

from annotated_types import Ge, Le

from robolink.messages import declared
from robolink.methods.declaration.look_parameters import LookParameters
from robolink.methods.declaration.method import MM, Help, Option, Pair, Rows

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
