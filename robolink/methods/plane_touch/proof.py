"""The proof of a tip on the plane on which it was measured."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robolink.calibration import TouchedPlane, VerifyResult, rotation_of, tilted_from
from robolink.messages import tr
from robolink.methods.pivot.tilts import OverPin, free_tilts
from robolink.methods.plane_touch.design import candidates
from robolink.methods.surface_drive import (
    SurfaceSpot,
    Vector,
    places_of,
    proving_spots,
    verify_on_surface,
)
from robolink.model import Pose, ToolOffset
from robolink.procedures import TouchPlan
from robolink.procedures.pin.tilting_proof import TiltingProof
from robolink.runner import Procedure

TURNED_DEG = 30.0
"""By how much the tilts are turned against those that were measured in."""


def verify_on_plane(
    plan: TouchPlan,
    plane: TouchedPlane,
    *,
    here: Pose,
    tip: ToolOffset,
    frame: ToolOffset,
    tilt_deg: float,
    axes: int,
    tolerance_mm: float,
    u_mm: float,
) -> Procedure[VerifyResult]:
    """Touch the plane that was found, below where the tip is, in tilts not measured in.

    Args:
        plan: Lift, clearance, contact input.
        plane: What is touched, as the measurement found it.
        here: The pose of the new tool, lifted and upright.
        tip: The tip, seen from the frame in force.
        frame: The frame in force, seen from the flange.
        tilt_deg: How far the tool leans.
        axes: How many axes the robot has, 0 where nobody knows.
        tolerance_mm: Largest drift that passes with its guard band.
        u_mm: Standard uncertainty of what one touch shows.

    Raises:
        CalibrationError: As :func:`~robolink.methods.surface_drive.verify_on_surface`.
    """
    normal, foot = _under(here, tip, plane)
    over = OverPin(here, foot, tip=tip, frame=frame)
    choice = candidates(tilt_deg, axes, turned_deg=TURNED_DEG)
    tilts = yield from free_tilts(over, choice, plan.lift_mm)
    spots = proving_spots(over, [SurfaceSpot(tilt, foot, normal) for tilt in tilts])
    return (
        yield from verify_on_surface(
            plan, over=over, spots=spots, tolerance_mm=tolerance_mm, u_mm=u_mm
        )
    )


def _under(here: Pose, tip: ToolOffset, plane: TouchedPlane) -> tuple[Vector, Vector]:
    """Return the upward normal of the plane, and its place straight below the tip."""
    sign = 1.0 if plane.normal[2] > 0 else -1.0
    nx, ny, nz = (sign * part for part in plane.normal)
    x, y, z = (np.array(here.coordinates()[:3]) + rotation_of(here) @ tip.components()[:3]).tolist()
    above_mm = x * nx + y * ny + z * nz - sign * plane.distance_mm
    return (nx, ny, nz), (x, y, z - above_mm / nz)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaneTest(TiltingProof):
    """All that the proof on a plane needs.

    Attributes:
        plane: The plane as the measurement found it.
        tilt_deg: How far the tool leans.
        axes: How many axes the robot has, 0 where nobody knows.
    """

    method: ClassVar[str] = "plane-touch"

    plane: TouchedPlane
    tilt_deg: float
    axes: int

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from over the plane, lifted and upright."""
        return verify_on_plane(
            self.touch,
            self.plane,
            here=here,
            tip=tilted_from(self.written, self.tip),
            frame=self.written,
            tilt_deg=self.tilt_deg,
            axes=self.axes,
            tolerance_mm=self.tolerance_mm,
            u_mm=self.u_mm,
        )

    def _first(self) -> tuple[str, str]:
        return tr("Jog the tip onto the surface."), tr("Lifting off the surface.")

    def _apart_mm(self, found: Pose) -> Vector:
        (place,) = places_of([found], tilted_from(self.written, self.tip))
        normal = np.array(self.plane.normal)
        away_mm = float(np.array(place) @ normal) - self.plane.distance_mm
        x_mm, y_mm, z_mm = (away_mm * normal).tolist()
        return x_mm, y_mm, z_mm
