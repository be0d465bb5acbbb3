"""How a proof with a tilting tool begins where nobody knows any more where the tip is.

A person brings the tip into contact first, the tool as upright as it was measured, so that the
first movement that the robot makes by itself is straight up from there, and nothing tilts from an
attitude that no plan foresaw.
"""

import math
from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Final

from robolink.calibration import CalibrationResult, Drift, VerifyResult, rotation_of, tip_pose
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset
from robolink.procedures.approach import offset_z
from robolink.procedures.pin.touch_plan import TouchPlan, plain_pose
from robolink.procedures.proving.kept_proof import PlacedProof, movements
from robolink.runner import Ask, Move, NotYet, Procedure, TouchedAt, TouchSubject

MOST_LEAN_DEG: Final = 5.0
"""So far from upright, against the measurement, a person may leave the tool; its turn is free."""

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class TiltingProof(PlacedProof):
    """A proof by touches of a tool that tilts.

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
        """Return what the person is asked for first, and what the way up from there is for."""

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
    """Return by how many degrees a tool leans against another attitude, however it is turned."""
    turned = rotation_of(pose) @ rotation_of(upright).T
    return math.degrees(math.acos(min(1.0, max(-1.0, float(turned[2, 2])))))


def upright_of(result: CalibrationResult, written: ToolOffset, tool: int) -> Pose:
    """Return how the frame of a written offset stood at the first touch of a measurement."""
    return tip_pose(plain_pose(result.inputs[0]), written, tool=tool)
