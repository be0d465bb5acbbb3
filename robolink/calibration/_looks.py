"""Looks at marks one after the other, the one that fits worst taken again."""

from collections.abc import Callable, Sequence
from typing import Generic

from robolink.calibration._camera_drive import CameraDrive, Place
from robolink.calibration._retaking import ResultT, settled
from robolink.calibration._steps import Procedure, SeenAt
from robolink.messages import tr
from robolink.model import Pose


class Looks(Generic[ResultT]):
    """Looks, and what they say; implements :class:`Retaking`.

    Args:
        drive: Brings marks before the camera.
        solver: Makes the result of the looks.
        here: Where the frame is.
        before_camera: Whether that is before the camera, with a mark in the image.
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
        return (yield from settled(self, places, seen, retake=retake))

    @property
    def known(self) -> str:
        return tr("X and Y are known")

    def counted(self, count: int) -> str:
        return tr("{count} looks", count=count)

    def take(self, place: Place) -> Procedure[SeenAt]:
        (seen,) = yield from self._drive.looks(
            [place], self._here, before_camera=self._before_camera
        )
        self._here, self._before_camera, self._last = self._drive.pose(place), True, place
        return seen

    def away(self) -> Procedure[None]:
        if self._last is None:
            return
        yield from self._drive.lifted(self._last)
        self._here, self._before_camera, self._last = self._drive.above(self._last), False, None

    def solve(self, looks: Sequence[SeenAt]) -> ResultT:
        return self._solver(looks)

    def which(self, number: int, look: SeenAt) -> str:
        return tr("Look {number}, at U {u:.1f}", number=number, u=look.u_deg)
