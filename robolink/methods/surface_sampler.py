"""Touches of a surface as samples: each made again alone, whichever it is and whenever it is asked.

Where the tilted touches are made depends on the first ones, which stand upright and show how the
surface lies. So a spot keeps its tilt, and its place is found anew each time from the upright
touches as they count now: one that is made again moves what is left, and nothing that was touched.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar, Generic

import numpy as np

from robolink.calibration import Floats, linear_fit
from robolink.messages import tr
from robolink.methods.pivot.tilts import UPRIGHT, OverPin, Tilt, TiltedNames, apart_deg
from robolink.methods.surface_drive import SurfaceDrive, SurfaceSpot, Vector, places_of
from robolink.model import Pose, ToolOffset
from robolink.procedures import SurfaceTouches, approach_path, resume_samples
from robolink.procedures.sampling.sampler import ResultT
from robolink.runner import Notify, Procedure, TouchedAt

_TIP_COLUMNS = 3


class SurfaceSampler(TiltedNames, ABC, Generic[ResultT]):
    """Touches of one surface, known by their numbers from 0; implements ``SequentialSampler``.

    Attributes:
        uprights: How many are made in the first orientation before the surface is known.

    Args:
        touches: How they are made; the first one is made already.
        over: Where it was made, and in which orientation the tool stood.
        stored: The offset stored now; the approaches use it.
        count: How many touches there are to be.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.
    """

    uprights: ClassVar[int]

    def __init__(
        self,
        touches: SurfaceTouches,
        over: OverPin,
        *,
        stored: ToolOffset,
        count: int,
        sigma_mm: float | None,
    ) -> None:
        self.touches = touches
        self.over = over
        self.stored = stored
        self.count = count
        self.sigma_mm = sigma_mm
        self.drive = SurfaceDrive(touches.plan, over, touches)
        self._spots: tuple[SurfaceSpot, ...] = ()

    def take(self, place: int) -> Procedure[Pose]:
        """Go to a spot, and have the surface touched there."""
        if place >= self.uprights:
            if not self._spots:
                self._spots = yield from self._laid_out()
            yield Notify(tr("Touch {k} of {n}", k=place + 1, n=self.count))
        spot, further_mm = self._spot(place)
        return (
            yield from self.drive.touch(
                spot, key=place, columns=self._columns(place, spot), further_mm=further_mm
            )
        )

    def away(self) -> Procedure[None]:
        """Stand upright again, lifted: a person may take their time, or nothing follows."""
        return self.drive.to(UPRIGHT)

    def foreseen(self, place: int) -> Pose:
        """Return the pose in which a tilted touch would be made."""
        return self.drive.pose(self._spot(place)[0])

    def gain(self, taken: Sequence[Pose]) -> float:
        """Return the standard deviation of the tip as a multiple of one touch's."""
        columns = self.derivatives(taken)
        fit = linear_fit(columns, np.zeros(len(columns)))
        return math.sqrt(float(fit.unit_covariance.diagonal()[:_TIP_COLUMNS].max()))

    def adopt(self, taken: Sequence[TouchedAt], choice: Sequence[Tilt]) -> None:
        """Take over the touches of a measurement that is gone on with.

        Args:
            taken: The touches.
            choice: The tilts in which they may have been made.
        """
        self.touches.adopt(dict(enumerate(taken)))
        tilts = [UPRIGHT] * self.uprights
        for pose in taken[self.uprights :]:
            tilts.append(min(choice, key=lambda tilt: apart_deg(self.over.pose(tilt, 0.0), pose)))
        spots = zip(tilts, places_of(taken, self.stored), strict=True)
        self._spots = tuple(SurfaceSpot(tilt, at, self.normal_at(at)) for tilt, at in spots)

    @abstractmethod
    def solve(self, taken: Sequence[Pose]) -> ResultT:
        """Return what they say, with their residuals in their order.

        Raises:
            CalibrationError: They say nothing that can be trusted.
        """

    @abstractmethod
    def derivatives(self, poses: Sequence[Pose]) -> Floats:
        """Return the derivatives of the distances by tip and surface, one row a pose."""

    @abstractmethod
    def normal_at(self, place_mm: Vector) -> Vector:
        """Return the unit normal of the surface, by the upright touches, nearest to a place.

        Raises:
            CalibrationError: They show a surface that is not to be touched so.
        """

    @abstractmethod
    def aligned(self, spot: SurfaceSpot) -> SurfaceSpot:
        """Return a spot where the upright touches, as they count now, say that it is.

        Raises:
            CalibrationError: They show a surface that is not to be touched so.
        """

    @abstractmethod
    def _upright(self, place: int) -> tuple[SurfaceSpot, float]:
        """Return the spot of an upright touch, and how much farther away it is kept."""

    @abstractmethod
    def _laid_out(self) -> Procedure[tuple[SurfaceSpot, ...]]:
        """Return the spots of all touches, when the upright ones are made.

        Raises:
            CalibrationError: The surface, or the arm, does not let the tip be told.
        """

    def upright_places(self) -> list[Vector]:
        """Return where the tip was at the upright touches made so far, base."""
        return places_of(self.touches.taken[: self.uprights], self.stored)

    def _spot(self, place: int) -> tuple[SurfaceSpot, float]:
        if place < self.uprights:
            return self._upright(place)
        return self.aligned(self._spots[place]), 0.0

    def _columns(self, place: int, spot: SurfaceSpot) -> Floats | None:
        """Return what tip and surface could explain of all the others and of this one."""
        if not self._spots:
            return None
        return self.derivatives([*self.touches.others(place), self.drive.pose(spot)])


def go_on_surface(
    sampler: SurfaceSampler[ResultT], *, here: Pose, taken: Sequence[TouchedAt], again: int
) -> Procedure[ResultT]:
    """Make one touch of a surface again. Runs in Tool 0, ends lifted and upright.

    Args:
        sampler: How; it has the touches adopted.
        here: Where the flange is.
        taken: The touches of the measurement.
        again: Index of the one that is made again.

    Raises:
        CalibrationError: As the measurement.
    """
    lift_mm = sampler.touches.plan.lift_mm
    yield from approach_path(
        sampler.over.pose(UPRIGHT, lift_mm), here=here, purpose=tr("Moving over the surface.")
    )
    return (yield from resume_samples(sampler, range(len(taken)), taken, again))
