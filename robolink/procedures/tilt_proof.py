"""The test with a tilting tool: how it starts after a break, and what surface touches show.

Where nobody knows any more where the tip is, a person brings it into contact first, the tool as
upright as it was measured, so that the first movement that the robot makes by itself is straight up
from there, and nothing tilts from an attitude that no plan foresaw.

One touch of a surface shows how far the tip is off along its normal alone. Touches in several tilts
show all three components: ``n_i R_i e = -d_i``, with d_i how far beyond the expected place the
frame went until the tip was on the surface (docs/reference/calibration.md 2.13).
"""

import math
from abc import abstractmethod
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from robolink.calibration import (
    CalibrationResult,
    Drift,
    DriftVerdict,
    VerifyResult,
    judge_drift,
    rotation_of,
    tip_pose,
)
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset
from robolink.procedures.approach import offset_z
from robolink.procedures.kept_proof import PlacedProof, movements
from robolink.procedures.witnessed_touches import TouchPlan, plain_pose
from robolink.runner import Ask, Move, NotYet, Procedure, TouchedAt, TouchSubject

MOST_LEAN_DEG: Final = 5.0
"""Largest lean of the tool, as a person leaves it, from the upright of the measurement, degrees;
its turn is free."""

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class TiltingProof(PlacedProof):
    """A turn test by touches of a tool that tilts.

    Attributes:
        touch: Lift, clearance, contact input.
        u_mm: Standard uncertainty of what one touch shows.
        upright: How the frame of the new tool stood when it was measured; only its angles count.
    """

    touch: TouchPlan
    u_mm: float
    upright: Pose

    def moves(self, here: Pose) -> int:  # noqa: ARG002 - it begins where the person touches
        """Return how many movements there are; see :meth:`KeptProof.moves`."""
        on_paper = replace(self, touch=replace(self.touch, nominal=True))
        x_mm, y_mm, z_mm = self._apart_mm(self.upright)
        there = self.upright
        contact = replace(
            there, x_mm=there.x_mm - x_mm, y_mm=there.y_mm - y_mm, z_mm=there.z_mm - z_mm
        )
        lifted = offset_z(contact, self.touch.lift_mm)
        return 1 + movements(on_paper.steps(lifted), lifted)

    def foreseen(self, here: Pose) -> Procedure[VerifyResult] | None:
        """Return its steps, each stop at its highest; see :meth:`KeptProof.foreseen`."""
        return replace(self, touch=replace(self.touch, nominal=True)).steps(here)

    def steps_after_a_break(self, here: Pose) -> Procedure[VerifyResult]:  # noqa: ARG002 - a person shows where it is
        """Return the steps from wherever the robot stands; a person touches first.

        A first contact farther from the measured one than the clearance ends it at once, failed:
        the robot would come down too near, or somewhere else.
        """
        instruction, lifting = self._first()
        subject = TouchSubject(
            number=1, contact=self.touch.contact, limit_mm=self.touch.clearance_mm
        )
        answer: Pose = yield Ask(
            instruction, contact=self.touch.contact, subject=subject, judge=self._not_upright
        )
        found = TouchedAt.of(answer)
        lifted = offset_z(plain_pose(found), self.touch.lift_mm)
        yield Move(lifted, Path.STRAIGHT, lifting)
        apart_mm = self._apart_mm(found)
        if math.hypot(*apart_mm) > self.touch.clearance_mm:
            drift = Drift(found.u_deg, *apart_mm, self.u_mm)
            limit_mm = min(self.tolerance_mm, self.touch.clearance_mm)
            return VerifyResult((drift,), limit_mm, inputs=(found,))
        return (yield from self.steps(lifted))

    @abstractmethod
    def _first(self) -> tuple[str, str]:
        """Return the first request to the person, and the purpose of the move up from there."""

    @abstractmethod
    def _apart_mm(self, found: Pose) -> Vector:
        """Return how far the first contact is from where it should be, base."""

    def _not_upright(self, touch: TouchedAt) -> NotYet | None:
        lean_deg = lean_against(self.upright, touch)
        if lean_deg <= MOST_LEAN_DEG:
            return None
        return NotYet(
            "not_upright",
            tr(
                "The tool leans {lean} deg. Jog it upright first, as it stood when it was "
                "measured: V {v}, W {w}.",
                lean=f"{lean_deg:.0f}",
                v=f"{self.upright.v_deg:.1f}",
                w=f"{self.upright.w_deg:.1f}",
            ),
        )


def lean_against(upright: Pose, pose: Pose) -> float:
    """Return by how many degrees a tool leans from another attitude, however it is turned."""
    turned = rotation_of(pose) @ rotation_of(upright).T
    return math.degrees(math.acos(min(1.0, max(-1.0, float(turned[2, 2])))))


def upright_of(result: CalibrationResult, written: ToolOffset, tool: int) -> Pose:
    """Return the attitude of the written frame at the first touch of a measurement."""
    return tip_pose(plain_pose(result.inputs[0]), written, tool=tool)


Direction = tuple[float, float, float]


@dataclass(slots=True)
class SurfaceProof:
    """What touches of a known surface show about the place of the tip.

    Attributes:
        shown_at: The pose in which the drift is shown.
        tolerance_mm: Largest drift that passes with its guard band, all directions together.
        u_mm: Standard uncertainty of what one touch shows.
        touches: Those made, in their order.
    """

    shown_at: Pose
    tolerance_mm: float
    u_mm: float
    touches: list[TouchedAt] = field(default_factory=list)
    _rows: list[list[float]] = field(default_factory=list)
    _beyond_mm: list[float] = field(default_factory=list)

    def add(self, place: Pose, found: TouchedAt, normal: Direction) -> None:
        """Add a touch.

        Args:
            place: Where the selected frame should have been.
            found: Where it was.
            normal: The surface's unit normal there.

        Example:
            >>> import math
            >>> from robolink.model import Pose
            >>> from robolink.procedures import SurfaceProof
            >>> from robolink.runner import TouchedAt
            >>> tilts = (0, 0), (40, 0), (-40, 0), (0, 40), (0, -40)
            >>> places = [Pose(0, 0, 0, 0, v_deg, w_deg) for v_deg, w_deg in tilts]
            >>> proof = SurfaceProof(places[0], tolerance_mm=0.2, u_mm=0.02)
            >>> for place in places:  # the tip is 0.1 mm short
            ...     deeper_mm = 0.1 * math.cos(math.radians(place.v_deg or place.w_deg))
            ...     found = Pose(0, 0, -deeper_mm, *place.coordinates()[3:])
            ...     proof.add(place, TouchedAt.of(found), normal=(0, 0, 1))
            >>> round(proof.drift().dz_mm, 3)
            0.1
        """
        self.touches.append(found)
        self._rows.append((np.array(normal) @ rotation_of(place)).tolist())
        way = zip(found.coordinates()[:3], place.coordinates()[:3], normal, strict=True)
        self._beyond_mm.append(sum((there - here) * along for there, here, along in way))

    def undecided(self) -> bool:
        """Whether the drift is neither surely inside the tolerance nor surely outside."""
        drift = self.drift()
        verdict = judge_drift(drift.distance_mm, drift.u_mm, self.tolerance_mm)
        return verdict is DriftVerdict.UNDECIDED

    def drift(self) -> Drift:
        """Return how far the tip is from where it should be, base axes at ``shown_at``."""
        rows = np.array(self._rows)
        turned = rotation_of(self.shown_at)
        _, sizes, _ = np.linalg.svd(rows, full_matrices=False)
        e, *_ = np.linalg.lstsq(rows, -np.array(self._beyond_mm), rcond=None)
        dx_mm, dy_mm, dz_mm = (turned @ e).tolist()
        weakest = float(sizes[-1]) if len(sizes) == len(turned) else 0.0
        u_mm = self.u_mm / weakest if weakest > 0 else math.inf
        return Drift(self.shown_at.u_deg, dx_mm, dy_mm, dz_mm, u_mm)

    def result(self) -> VerifyResult:
        """Return their joint result."""
        return VerifyResult(
            (self.drift(),), self.tolerance_mm, inputs=tuple(self.touches), in_space=True
        )
