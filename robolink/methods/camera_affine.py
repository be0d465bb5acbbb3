"""camera-affine: an up-looking camera whose place and scale are unknown, found with the tip."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Final

from annotated_types import Ge, Le

from robolink.calibration import (
    MIN_ROTATION_DEG,
    USUAL_CAMERA,
    CalibrationResult,
    CameraLimits,
    angle_spread_deg,
    height_of,
    offset_sigma_mm,
    solvable_planes,
    toward_zero,
)
from robolink.errors import CalibrationError
from robolink.messages import declared, tr
from robolink.methods.method import (
    DEGREES,
    MM,
    Former,
    Help,
    Method,
    Needs,
    Option,
    Pair,
    Rows,
    Site,
)
from robolink.methods.shared_parameters import (
    PLACE,
    UNMEASURED_Z,
    LookParameters,
    camera_at,
)
from robolink.model import Pose, TipSensor, ToolOffset, checks_arguments, json_fields
from robolink.procedures import (
    NO_OFFSET,
    CameraDrive,
    CameraSamples,
    LookSource,
    Place,
    ProofBasis,
    pixel_camera,
    proof_angles,
    radius_of,
)
from robolink.runner import Procedure, SeenAt
from robolink.sensing import sensor_name
from robolink.stations import CameraStation, Found, StationKind

if TYPE_CHECKING:
    from robolink.calibration import CameraCalibration
    from robolink.methods.camera import LookTest
    from robolink.procedures import TipSource


LEAST_SPAN_MM: Final = 0.2
"""Smallest size of a pattern that shows the scale of a pixel, in mm."""


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
        """The solver's limits for a refusal."""
        return CameraLimits(
            most_shear_deg=self.shear_limit_deg,
            most_unequal_scale=self.unequal_limit,
            most_rms_px=self.residual_limit_px,
            interval_mm=self.interval_limit_mm,
            most_mm_per_px=self.pixel_limit_mm,
        )

    @property
    def corners_deg(self) -> tuple[float, ...]:
        """Angles of the pattern's corners, which are looked at without a turn."""
        return (0.0,)

    @property
    def places(self) -> tuple[tuple[float, float, float], ...]:
        """Every look: X and Y from the middle in mm, turn in degrees."""
        span = self.span_mm
        cross = ((-span, -span), (span, -span), (span, span), (-span, span))
        return (*((dx, dy, 0.0) for dx, dy in cross), *((0.0, 0.0, t) for t in self.turns_deg))


@checks_arguments
def measure_camera_affine(
    station: CameraStation,
    plan: CameraAffineParameters,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
) -> "Procedure[CameraCalibration]":
    """Measure X and Y of a tip, and the camera with it. Runs in Tool 0.

    The tip goes to four corners about the middle of the image, which tells what a pixel is,
    and turns in the middle, which tells the offset.

    Args:
        station: Where the camera is, to within its field of view; with its earlier model,
            against which a changed camera is refused.
        plan: The pattern, and whether the look that fits worst is offered again.
        here: Where the flange is; its U is that of the corners.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.

    Raises:
        CalibrationError: ``rank_deficient`` and ``insufficient_rotation`` before anything moves
            when the pattern cannot tell, and ``tilted_pose``; ``tip_not_seen``,
            ``several_tips_seen``, ``tip_did_not_move``, ``spot_changed``, ``camera_changed``, and
            the others of :func:`solve_camera_affine`.

    Example:
        >>> from robolink.methods import CameraAffineParameters, measure_camera_affine
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> camera, here = CameraStation(x_mm=300, y_mm=80, z_mm=-30), Pose(300, 100, 20, 0)
        >>> plan, stored = CameraAffineParameters(), ToolOffset(12, -3.5, -20)
        >>> course = measure_camera_affine(camera, plan, here=here, stored=stored)
        >>> found = PaperCell(here, ToolOffset(12.2, -3.6, -20), mm_per_px=0.02).run(course)
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.2, -3.6)
    """
    from robolink.calibration import PixelSighting, solve_camera_affine

    _require_pattern(plan)
    solvable_planes([here], height_of(stored))
    tip = stored or NO_OFFSET
    drive = CameraDrive(station, plan.look, here, calibrated=False)
    drive.watch.longest_mm_per_px = plan.pixel_limit_mm
    places = [
        Place(toward_zero(here.u_deg, turn), tip, aside_mm=(dx, dy)) for dx, dy, turn in plan.places
    ]

    def solve(looks: Sequence[SeenAt]) -> "CameraCalibration":
        sightings = [PixelSighting(look, look.spot.x, look.spot.y) for look in looks]
        found = solve_camera_affine(
            sightings,
            stored=stored,
            sigma_mm=sigma_mm,
            before=station.model,
            limits=plan.limits,
        )
        drive.watch.require_followed(found.camera.mm_per_px)
        return found

    return (yield from CameraSamples(drive, solve, here).at(places, retake=plan.retake))


def _require_pattern(plan: CameraAffineParameters) -> None:
    """Refuse a pattern that cannot separate camera and offset, before anything moves."""
    if plan.span_mm < LEAST_SPAN_MM:
        raise CalibrationError(
            "rank_deficient",
            tr("A pattern of {span:g} mm is too small to tell what a pixel is.", span=plan.span_mm),
            remedy=tr("Let the tip go {least:g} mm or more to each side.", least=LEAST_SPAN_MM),
        )
    spread_deg = angle_spread_deg([0.0, *plan.look.turns_deg])
    if spread_deg < MIN_ROTATION_DEG:
        raise CalibrationError(
            "insufficient_rotation",
            tr("The pattern turns the tool by {spread:.1f} degrees only.", spread=spread_deg),
            remedy=tr("Turn it by {minimum:.0f} degrees or more.", minimum=MIN_ROTATION_DEG),
        )


@dataclass(frozen=True, slots=True)
class CameraAffineSource(LookSource):
    """Measures X and Y of a tip, and the camera that sees it, in one pattern of looks.

    Attributes:
        sensor: URL or name of the camera, or the camera; it answers in pixels.
        station: Where it is to within its field of view; with its earlier model, a camera
            that changed is refused.
        plan: The pattern.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        name: Name of the station, under which the camera is kept on record; empty for not.
    """

    plan: CameraAffineParameters = field(default_factory=CameraAffineParameters)
    sigma_mm: float | None = None
    name: str = ""

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: camera {sensor} and tip found together by {count} looks",
            sensor=sensor_name(self.sensor),
            count=len(self.plan.places),
        )

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Did the camera find the tip in all pictures, and is it clean?")

    def found_station(self, result: CalibrationResult, tool: int) -> Found | None:
        """Return what a kept measurement shows about the camera, ``None`` without a name."""
        from robolink.calibration import CameraCalibration  # numpy, imported only when used

        if not self.name or not isinstance(result, CameraCalibration):
            return None
        model = result.camera
        return Found(
            id=self.name,
            kind=StationKind.CAMERA,
            **json_fields(self.station, "x_mm", "y_mm", "z_mm"),
            sigma_mm=offset_sigma_mm(result),
            how=tr("{method} with tool {tool}", method=result.method, tool=tool),
            tool=tool,
            details={
                "seen_by": sensor_name(self.sensor),
                **json_fields(model, "mm_per_px", "origin_mm", "centre_mm"),
                **json_fields(model, "place_sigma_mm", "scale_sigma"),
            },
        )

    def opened(self) -> AbstractContextManager[TipSensor]:
        """Open the camera, which answers in pixels; see :func:`pixel_camera`."""
        return pixel_camera(self.sensor, self.station)

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`."""
        return measure_camera_affine(
            self.station,
            self.plan,
            here=here,
            stored=stored,
            sigma_mm=self.sigma_mm,
        )

    def proof_of(self, basis: ProofBasis) -> "LookTest":
        """Return the test at other angles; see :meth:`~robolink.procedures.ProvesAgain.proof_of`.

        Raises:
            TypeError: The result is not that of a camera that was found.
        """
        from robolink.calibration import CameraCalibration
        from robolink.methods.camera import LookTest  # numpy, imported only when used

        if not isinstance(basis.result, CameraCalibration):
            raise TypeError(f"no camera was found by {basis.result.method}")
        return LookTest(
            **basis.common,
            sensor=self.sensor,
            station=replace(self.station, model=basis.result.camera),
            plan=self.plan.look,
            angles_deg=proof_angles(basis.result, basis.tool),
            radius_px=radius_of(basis.result),
        )


def _source(parameters: CameraAffineParameters, site: Site) -> "TipSource":
    sensor, station = camera_at(parameters, site)
    if parameters.new_camera:
        station = replace(station, model=None)
    return CameraAffineSource(
        sensor, station, parameters, sigma_mm=site.sigma_mm, name=site.station.id
    )


METHOD = Method(
    name="camera-affine",
    summary=declared("Find an up-looking camera and the tip together."),
    description=declared(
        "Find an up-looking camera and the tip together: X and Y, scale, turn and mirror.\n\n"
        "State where the camera looks, to within its field of view, with the command or in the "
        "cell file. The tip moves to four corners of the image and turns in its middle. "
        "robolink records the result under the name of the station, and refuses a camera that "
        "has changed since."
    ),
    parameters=CameraAffineParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.CAMERA, sensor=True, place=PLACE),
    source=_source,
    unmeasured_z=UNMEASURED_Z,
    formerly=(Former(kind="camera_affine"),),
)
