"""The proof of a tip on the sphere on which it was measured."""

import math
from dataclasses import dataclass
from typing import ClassVar

from robolink.calibration import VerifyResult, tilted_from
from robolink.messages import tr
from robolink.methods.pivot.tilts import OverPin, free_tilts
from robolink.methods.plane_touch.design import candidates
from robolink.methods.plane_touch.proof import TURNED_DEG
from robolink.methods.sphere_touch.design import reachable
from robolink.methods.sphere_touch.survey import SphereSurvey
from robolink.methods.surface_drive import (
    SurfaceDrive,
    Vector,
    places_of,
    proving_spots,
    verify_on_surface,
)
from robolink.model import Pose, ToolOffset
from robolink.procedures import SurfaceTouches, TouchPlan
from robolink.procedures.pin.tilting_proof import TiltingProof
from robolink.runner import Procedure


@dataclass(frozen=True, slots=True)
class TouchedSphere:
    """A sphere in the base."""

    centre_mm: tuple[float, float, float]
    radius_mm: float


def verify_on_sphere(
    plan: TouchPlan,
    survey: SphereSurvey,
    sphere: TouchedSphere,
    *,
    here: Pose,
    tip: ToolOffset,
    frame: ToolOffset,
    axes: int,
    tolerance_mm: float,
    u_mm: float,
) -> Procedure[VerifyResult]:
    """Touch the sphere that was found, in tilts not measured in.

    Args:
        plan: Lift, clearance, contact input.
        survey: From which sides it may be touched.
        sphere: What is touched, as the measurement found it.
        here: The pose of the new tool, lifted and upright.
        tip: The tip, seen from the frame in force.
        frame: The frame in force, seen from the flange.
        axes: How many axes the robot has, 0 where nobody knows.
        tolerance_mm: Largest drift that passes with its guard band.
        u_mm: Standard uncertainty of what one touch shows.

    Raises:
        CalibrationError: As :func:`~robolink.methods.surface_drive.verify_on_surface`.
    """
    (x_mm, y_mm, z_mm), radius_mm = sphere.centre_mm, sphere.radius_mm
    over = OverPin(here, (x_mm, y_mm, z_mm + radius_mm), tip=tip, frame=frame)
    drive = SurfaceDrive(plan, over, SurfaceTouches(plan))
    choice = candidates(survey.tilt_deg, axes, turned_deg=TURNED_DEG)
    tilts = yield from free_tilts(over, choice, plan.lift_mm)
    possible = reachable(drive, (x_mm, y_mm, z_mm), radius_mm, tilts, survey)
    return (
        yield from verify_on_surface(
            plan,
            over=over,
            spots=proving_spots(over, possible),
            tolerance_mm=tolerance_mm,
            u_mm=u_mm,
        )
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SphereTest(TiltingProof):
    """All that the proof on a sphere needs.

    Attributes:
        survey: From which sides it may be touched.
        sphere: The sphere as the measurement found it.
        axes: How many axes the robot has, 0 where nobody knows.
    """

    method: ClassVar[str] = "sphere-touch"

    survey: SphereSurvey
    sphere: TouchedSphere
    axes: int

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from over the sphere, lifted and upright."""
        return verify_on_sphere(
            self.touch,
            self.survey,
            self.sphere,
            here=here,
            tip=tilted_from(self.written, self.tip),
            frame=self.written,
            axes=self.axes,
            tolerance_mm=self.tolerance_mm,
            u_mm=self.u_mm,
        )

    def _first(self) -> tuple[str, str]:
        return tr("Jog the tip onto the top of the sphere."), tr("Lifting off the surface.")

    def _apart_mm(self, found: Pose) -> Vector:
        (place,) = places_of([found], tilted_from(self.written, self.tip))
        out = [at - middle for at, middle in zip(place, self.sphere.centre_mm, strict=True)]
        # Straight up from beside the top the sphere is in the way: that is far away, however near.
        on_top = math.hypot(*out[:2]) <= self.survey.most_aside * self.sphere.radius_mm
        nearest = out if on_top and out[2] > 0 else [0.0, 0.0, 1.0]
        share = self.sphere.radius_mm / math.hypot(*nearest)
        x_mm, y_mm, z_mm = (at - share * to for at, to in zip(out, nearest, strict=True))
        return x_mm, y_mm, z_mm
