"""Looks of a camera: as samples of a measurement, and as the test of a new tip."""

from collections.abc import Callable, Sequence
from typing import Final, Generic

from robolink.calibration import Drift, FlangePlane, VerifyResult
from robolink.messages import tr
from robolink.model import TIP, Pose, ToolOffset, checks_arguments
from robolink.procedures.approach import NO_OFFSET
from robolink.procedures.camera_drive import CameraDrive, LookPlan, Place
from robolink.procedures.sample_sequence import finalize_samples
from robolink.procedures.samples import ResultT
from robolink.runner import Procedure, SeenAt
from robolink.stations import CameraStation


class CameraSamples(Generic[ResultT]):
    """Looks, and their result; implements :class:`Sampler`.

    Args:
        drive: Brings marks before the camera.
        solver: Makes the result of the looks.
        here: Where the frame is.
        before_camera: Whether that is before the camera, with a mark in the image.

    Example:
        >>> from robolink.calibration import solve_camera_round
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import CameraDrive, CameraSamples, LookPlan, Place
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> here, tip = Pose(300, 100, 20, 0), ToolOffset(12, -4, -20)
        >>> station = CameraStation(300, 80, -30)
        >>> def solver(looks):
        ...     return solve_camera_round([station.sighting(look) for look in looks], stored=tip)
        >>> samples = CameraSamples(CameraDrive(station, LookPlan(), here), solver, here)
        >>> places = [Place(u_deg, tip) for u_deg in (0, 120, 240)]
        >>> cell = PaperCell(here, ToolOffset(12.2, -4.1, -20))
        >>> found = cell.run(samples.at(places, retake=False))
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.2, -4.1)
    """

    def __init__(
        self,
        drive: CameraDrive,
        solver: Callable[[Sequence[SeenAt]], ResultT],
        here: Pose,
        *,
        before_camera: bool = False,
    ) -> None:
        self._drive = drive
        self._solver = solver
        self._here = here
        self._before_camera = before_camera
        self._last: Place | None = None

    def at(self, places: Sequence[Place], *, retake: bool) -> Procedure[ResultT]:
        """Look at every place, and return the result. Ends lifted.

        Args:
            places: What to look at.
            retake: Whether the look that fits worst is offered to be taken again.

        Raises:
            CalibrationError: Those of the solver, and of :meth:`CameraDrive.looks`.
        """
        seen = list[SeenAt]()
        for place in places:
            seen.append((yield from self.take(place)))
        return (yield from finalize_samples(self, places, seen, retake=retake))

    @property
    def known(self) -> str:
        """Which lengths become known."""
        return tr("X and Y")

    def counted(self, count: int) -> str:
        """Say how many were taken."""
        return tr("{count} looks", count=count)

    def take(self, place: Place) -> Procedure[SeenAt]:
        """Take one; see :class:`~robolink.procedures.Sampler`."""
        (seen,) = yield from self._drive.looks(
            [place], self._here, before_camera=self._before_camera
        )
        self._here, self._before_camera, self._last = self._drive.pose(place), True, place
        return seen

    def away(self) -> Procedure[None]:
        """Lift the tip; see :class:`~robolink.procedures.Sampler`."""
        if self._last is None:
            return
        yield from self._drive.lifted(self._last)
        self._here, self._before_camera, self._last = self._drive.above(self._last), False, None

    def solve(self, looks: Sequence[SeenAt]) -> ResultT:
        """Solve what was taken."""
        return self._solver(looks)

    def which(self, number: int, look: SeenAt) -> str:
        """Say which one it is."""
        return tr("Look {number} at U {u:.1f}", number=number, u=look.u_deg)


NO_ERROR: Final = (0.0, 0.0)


@checks_arguments
def verify_by_looking(
    station: CameraStation,
    plan: LookPlan,
    *,
    here: Pose,
    angles_deg: Sequence[float],
    tolerance_mm: float,
    camera_error_mm: tuple[float, float] = NO_ERROR,
    aside: ToolOffset = NO_OFFSET,
    radius_px: float | None = None,
) -> Procedure[VerifyResult]:
    """Turn about the new tip and look at it again. Runs in the new tool; ends lifted.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: Pictures and heights.
        here: Where the frame of the new tool is.
        angles_deg: Its angles U at which the tip is looked at.
        tolerance_mm: Largest drift that passes.
        camera_error_mm: What the camera is off by, as the measurement found it.
        aside: Where the tip is expected, seen from the selected frame; not 0 where a difference
            to a reference was written.
        radius_px: How wide its spot was in the measurement; ``None`` where nobody told.

    The drift is how far from where the controller puts it the tip is seen.

    Raises:
        CalibrationError: As :func:`~robolink.methods.measure_camera`.

    Example:
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import LookPlan, verify_by_looking
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> station, here = CameraStation(300, 80, -30), Pose(300, 80, 0, 0)
        >>> proof = verify_by_looking(
        ...     station, LookPlan(), here=here, angles_deg=(0, 120), tolerance_mm=0.2
        ... )
        >>> shown = PaperCell(here, ToolOffset(0.3)).run(proof)
        >>> shown.passed, round(shown.max_drift_mm, 3)
        (False, 0.3)
    """
    drive = CameraDrive(station, plan, here)
    drive.watch.expect_radius(TIP, radius_px)
    places = [Place(u_deg, aside) for u_deg in nearest_first(angles_deg, here)]
    return (
        yield from look_again(
            drive, places, here, tolerance_mm=tolerance_mm, camera_error_mm=camera_error_mm
        )
    )


def look_again(
    drive: CameraDrive,
    places: Sequence[Place],
    here: Pose,
    *,
    tolerance_mm: float,
    camera_error_mm: tuple[float, float] = NO_ERROR,
) -> Procedure[VerifyResult]:
    """Look at marks and return how far each is from where the controller puts it; ends lifted.

    Args:
        drive: Brings them before the camera.
        places: The marks, with where they should be.
        here: Where the frame of the new tool is.
        tolerance_mm: Largest drift that passes.
        camera_error_mm: What the camera is off by, as the measurement found it.
    """
    seen = yield from drive.looks(places, here)
    yield from drive.lifted(places[-1])
    drifts = [
        seen_drift(drive.station, look, place, camera_error_mm)
        for look, place in zip(seen, places, strict=True)
    ]
    return VerifyResult(tuple(drifts), tolerance_mm)


def nearest_first(angles_deg: Sequence[float], here: Pose) -> list[float]:
    """Return angles in the order in which the tool winds up least."""
    return sorted(angles_deg, key=lambda u_deg: abs(u_deg - here.u_deg))


def seen_drift(
    station: CameraStation, look: SeenAt, place: Place, camera_error_mm: tuple[float, float]
) -> Drift:
    """Return how far a mark was seen from where the controller puts it.

    Args:
        station: Where the camera is, and what its pixels mean.
        look: What was seen, and where the frame was.
        place: Where the mark is, by the controller, in that frame.
        camera_error_mm: What the camera is off by, as the measurement found it; base X and Y.

    Example:
        >>> from robolink.model import Pose, Spot, SpotUnit, ToolOffset
        >>> from robolink.procedures import Place, seen_drift
        >>> from robolink.runner import SeenAt
        >>> from robolink.stations import CameraStation
        >>> look = SeenAt.of(Pose(300, 80, -30, 0), Spot(300.15, 80), SpotUnit.BASE_MM)
        >>> station, place = CameraStation(300, 80, -30), Place(0, ToolOffset())
        >>> round(seen_drift(station, look, place, camera_error_mm=(0.1, 0)).dx_mm, 3)
        0.05
    """
    sighting, (error_x, error_y) = station.sighting(look), camera_error_mm
    dx, dy = FlangePlane.of(look).in_base(place.at.x_mm, place.at.y_mm, place.at.z_mm)
    return Drift(
        look.u_deg,
        sighting.x_mm - error_x - look.x_mm - dx,
        sighting.y_mm - error_y - look.y_mm - dy,
    )
