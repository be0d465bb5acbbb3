"""Looks of a camera as samples, and what they say together."""

from collections.abc import Callable, Sequence
from typing import Generic

from robolink.messages import tr
from robolink.model import Pose
from robolink.procedures.camera.drive import CameraDrive, Place
from robolink.procedures.sampling.sampler import ResultT
from robolink.procedures.sampling.sequential import finalize_samples
from robolink.runner import Procedure, SeenAt


class CameraSamples(Generic[ResultT]):
    """Looks, and what they say; implements :class:`Sampler`.

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
        """Look at every place, and return what that says. Ends lifted.

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
