"""A tip touched onto a pin with the tool tilted and turned: X, Y and Z, on five axes and six.

Nothing ever tilts in contact: the tip is lifted, tilted in the air in small steps that keep it
above the pin, and comes down to a clearance; the last bit is done by the person.
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from robolink.calibration import (
    PERSON_U_DRIFT_MM,
    CalibrationResult,
    VerifyResult,
    pose_arrays,
    sigma_gain,
    solve_pivot,
    tilted_from,
)
from robolink.messages import tr
from robolink.methods.pivot import PivotSource
from robolink.methods.pivot.tilts import (
    UPRIGHT,
    OverPin,
    Tilt,
    TiltedNames,
    proving_in_reach,
    proving_tilts,
    tilt_in_air,
    tilts_in_reach,
)
from robolink.model import Pose, ToolOffset, checks_arguments
from robolink.procedures import (
    MOST_MORE,
    DriftProof,
    PinTouches,
    TouchPlan,
    approach_path,
    resume_samples,
    sample_sequentially,
)
from robolink.procedures.tilt_proof import TiltingProof, Vector
from robolink.runner import Notify, Procedure, TouchedAt


def pivot_then_lift(
    source: PivotSource, stored: ToolOffset
) -> Procedure[tuple[CalibrationResult, Pose]]:
    """Measure as a source says; return the pose of the lifted flange as well.

    Args:
        source: What is measured, and how.
        stored: The offset stored now.
    """
    plan = source.touch
    touches = PinTouches(plan, planar=False, retakes=True)
    first = yield from touches.first(UPRIGHT)
    over = OverPin.touched(first, stored)
    tilts = yield from tilts_in_reach(over, source.tilts, plan.lift_mm)
    swing = _Swing(plan, over, touches)
    tilting = _PivotSampler(swing, stored, source.sigma_mm)
    result = yield from sample_sequentially(tilting, first, [UPRIGHT, *tilts], source.sampling)
    yield from swing.to(UPRIGHT)
    touches.require_made()
    return result, swing.over.pose(UPRIGHT, plan.lift_mm)


def retake_pivot(
    source: PivotSource,
    stored: ToolOffset,
    *,
    here: Pose,
    taken: Sequence[TouchedAt],
    again: int | None,
) -> Procedure[CalibrationResult]:
    """Repeat one touch of a measurement. Runs in Tool 0, ends as it does.

    Args:
        source: What was measured, and how.
        stored: The offset stored now.
        here: Where the flange is, upright.
        taken: The touches of the measurement.
        again: Index of the one that is made again; ``None`` for the last one.

    Raises:
        CalibrationError: As :func:`~robolink.methods.measure_pivot`.
    """
    plan = source.touch
    over = OverPin.touched(taken[0], stored)
    places = [UPRIGHT, *(yield from tilts_in_reach(over, source.tilts, plan.lift_mm))][: len(taken)]
    touches = PinTouches(plan, planar=False, retakes=True)
    touches.adopt(dict(zip(places, taken, strict=True)))
    yield from approach_path(
        over.pose(UPRIGHT, plan.lift_mm), here=here, purpose=tr("Moving above the pin.")
    )
    swing = _Swing(plan, over, touches)
    tilting = _PivotSampler(swing, stored, source.sigma_mm)
    again = len(taken) - 1 if again is None else again
    result = yield from resume_samples(tilting, places, taken, again)
    yield from swing.to(UPRIGHT)
    touches.require_made()
    return result


@checks_arguments
def verify_by_tilting(
    plan: TouchPlan,
    *,
    over: OverPin,
    tilts: Sequence[Tilt],
    tolerance_mm: float,
    u_mm: float | None = None,
) -> Procedure[VerifyResult]:
    """Tilt about the new tip and let a person show where it went. Runs in the new tool.

    Args:
        plan: Lift, clearance, contact input.
        over: The pin, and where the tip is in the selected frame.
        tilts: Orientations in which the tip is brought back onto the pin.
        tolerance_mm: Largest drift that passes with its guard band, in all three directions
            together.
        u_mm: Standard uncertainty of the drift that one touch shows, ``None`` for the usual one.

    The tip starts lifted and upright. The distance that the person jogs it, from where it should
    have been to the pin, is the drift; the robot stops beside that place, so that no jog is no
    answer. A drift too near to the tolerance is touched again, as in
    :func:`~robolink.procedures.verify_by_turning`. It ends as it started.

    Raises:
        CalibrationError: ``not_tilted``, and ``not_touched`` or ``typed_ahead`` with the tip drawn
            back.

    Example:
        >>> from robolink.methods import OverPin, proving_tilts, verify_by_tilting
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> pin_mm, lifted = (310, 95, -40), Pose(310, 95, -30, 0)
        >>> proof = verify_by_tilting(
        ...     TouchPlan(), over=OverPin(lifted, pin_mm), tilts=proving_tilts(30), tolerance_mm=0.2
        ... )
        >>> shown = PaperCell(lifted, ToolOffset(0, 0, -1), pin_mm).run(proof)  # 1 mm too long
        >>> shown.passed, shown.max_drift_mm > 0.4
        (False, True)
    """
    tilts = yield from proving_in_reach(over, tilts, plan.lift_mm)
    swing = _Swing(plan, over, PinTouches(plan, planar=False, limit_mm=tolerance_mm))
    proof = DriftProof(tolerance_mm, PERSON_U_DRIFT_MM if u_mm is None else u_mm)
    by_place = {over.pose(tilt, 0.0).u_deg: tilt for tilt in tilts}
    for tilt in tilts:
        yield from _shown(swing, proof, tilt)
    for _ in range(MOST_MORE):
        doubted = proof.undecided()
        if doubted is None:
            break
        yield Notify(proof.told(doubted))
        yield from _shown(swing, proof, by_place[doubted.u_deg])
    yield from swing.to(UPRIGHT)
    return proof.result()


def _shown(swing: "_Swing", proof: DriftProof, tilt: Tilt) -> Procedure[None]:
    swing.touches.tell_of(proof.so_far())
    found = yield from swing.touch(
        tilt,
        tr("Jog the tip onto the pin again. robolink measures how far off it was."),
        key=len(proof.touches),
    )
    proof.add(swing.over.pose(tilt, 0.0), found, in_space=True)


class _Swing:
    """Tilts a lifted tool over a pin, and lets a person touch the pin.

    Args:
        plan: Lift and clearance.
        over: The pin.
        touches: How it is touched.
    """

    def __init__(self, plan: TouchPlan, over: OverPin, touches: PinTouches) -> None:
        self.over = over
        self._plan = plan
        self.touches = touches
        self._stands = UPRIGHT

    def to(self, goal: Tilt) -> Procedure[None]:
        """Tilt in the air.

        Raises:
            CalibrationError: ``not_tilted``: the robot stands otherwise than it was told.
        """
        yield from tilt_in_air(self.over, self._stands, goal, self._plan.lift_mm)
        self._stands = goal

    def touch(self, tilt: Tilt, instruction: str, *, key: Hashable) -> Procedure[TouchedAt]:
        """Tilt in the air, come down beside the pin, let the person touch it, and lift off."""
        yield from self.to(tilt)
        return (
            yield from self.touches.again(
                self.over.pose(tilt, 0.0),
                key=key,
                turning=tr("Moving beside the pin."),
                instruction=instruction,
            )
        )


@dataclass(frozen=True, slots=True)
class _PivotSampler(TiltedNames):
    """Tilted touches; implements ``SequentialSampler``. Each ends lifted off the pin."""

    swing: _Swing
    stored: ToolOffset
    sigma_mm: float | None

    def take(self, place: Tilt) -> Procedure[Pose]:
        return self.swing.touch(
            place, tr("Jog the tip onto the pin again; the tool is tilted now."), key=place
        )

    def away(self) -> Procedure[None]:
        yield from ()

    def foreseen(self, place: Tilt) -> Pose:
        return self.swing.over.pose(place, 0.0)

    def solve(self, touches: Sequence[Pose]) -> CalibrationResult:
        return solve_pivot(touches, stored=self.stored, sigma_mm=self.sigma_mm)

    def gain(self, poses: Sequence[Pose]) -> float:
        return sigma_gain(pose_arrays(poses)[1])


@dataclass(frozen=True, slots=True, kw_only=True)
class TiltTest(TiltingProof):
    """All that a tilt test at a pin needs.

    Attributes:
        pin_mm: The pin as the measurement found it, base.
        tilt_deg: How far the tool leans.
    """

    method: ClassVar[str] = "pivot"

    pin_mm: tuple[float, float, float]
    tilt_deg: float

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from over the pin, lifted and upright."""
        tip = tilted_from(self.written, self.tip)
        return verify_by_tilting(
            self.touch,
            over=OverPin(here, self.pin_mm, tip=tip, frame=self.written),
            tilts=proving_tilts(self.tilt_deg),
            tolerance_mm=self.tolerance_mm,
            u_mm=self.u_mm,
        )

    def _first(self) -> tuple[str, str]:
        return tr("Jog the tip onto the pin."), tr("Lifting off the pin.")

    def _apart_mm(self, found: Pose) -> Vector:
        at = OverPin.touched(found, tilted_from(self.written, self.tip)).pin_mm
        x_mm, y_mm, z_mm = (there - pin for there, pin in zip(at, self.pin_mm, strict=True))
        return x_mm, y_mm, z_mm
