"""The turn test of a tip on a pin: turn about it, stop beside the pin, let a person touch it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Final

from robolink.calibration import (
    PERSON_U_DRIFT_MM,
    CalibrationResult,
    Drift,
    DriftVerdict,
    FlangePlane,
    VerifyResult,
    flange_of,
    judge_drift,
    tip_pose,
)
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, checks_arguments
from robolink.procedures.approach import NO_OFFSET, offset_z
from robolink.procedures.kept_proof import KeptProof
from robolink.procedures.pin_touches import PinTouches
from robolink.procedures.source import MeasurementContext
from robolink.procedures.witnessed_touches import TouchPlan, heights_agree, plain_pose
from robolink.runner import AngleShown, Notify, Procedure, TouchedAt, first_clear

MOST_MORE: Final = 2
"""Largest number of further touches for a drift that is neither certainly inside nor outside the
limit."""


@checks_arguments
def verify_by_turning(
    plan: TouchPlan,
    *,
    contact: Pose,
    angles_deg: Sequence[float],
    tolerance_mm: float,
    u_mm: float | None = None,
    written: ToolOffset = NO_OFFSET,
    tip: ToolOffset = NO_OFFSET,
    in_space: bool = False,
) -> Procedure[VerifyResult]:
    """Turn about the new tip and let a person show where it went. Runs in the new tool.

    Args:
        plan: Lift, clearance, contact input.
        contact: Pose of the new tool's tip on the pin, as the calibration implies it.
        angles_deg: Tool angles U at which the tip is brought back onto the pin.
        tolerance_mm: Largest drift that passes, with its guard band.
        u_mm: Standard uncertainty of the drift that one touch shows, ``None`` for the usual one.
        written: The active offset.
        tip: Where the tip was found. It differs from ``written`` where a difference was
            written, and then the selected frame does not turn about the tip.
        in_space: Whether its height counts as drift. Only a contact input tells a height as well as
            a place; what a person sees of it scatters more (docs/reference/evidence.md 1), so their
            heights are compared by a limit of their own.

    The tip starts lifted. The distance that the person jogs it, from where it should have
    been to the pin, is the drift; the robot stops beside that place, so that no jog is no answer.
    A drift that is neither surely inside the tolerance nor outside is touched again, at most twice;
    what counts is the mean then. It ends lifted.

    Raises:
        CalibrationError: ``not_touched`` or ``typed_ahead``, with the tip drawn back.
        LimitError: The arm cannot turn so over this pin, nor two thirds as far.

    Example:
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan, verify_by_turning
        >>> from robolink.testing import PaperCell
        >>> contact = Pose(310, 95, -40, 0)
        >>> proof = verify_by_turning(
        ...     TouchPlan(), contact=contact, angles_deg=(120, 240), tolerance_mm=0.2
        ... )
        >>> cell = PaperCell(Pose(310, 95, -30, 0), ToolOffset(0.5), (310, 95, -40))
        >>> shown = cell.run(proof)  # the tip is 0.5 mm beside where its offset says
        >>> shown.passed, round(shown.max_drift_mm, 3)
        (False, 0.5)
    """
    turning = _Turning(plan, contact, tolerance_mm, written, tip)
    angles_deg = yield from first_clear(
        [tuple(angles_deg), tuple(_nearer(contact.u_deg, angle) for angle in angles_deg)],
        turning.on_paper,
        offset_z(plain_pose(contact), plan.lift_mm),
    )
    proof = DriftProof(tolerance_mm, PERSON_U_DRIFT_MM if u_mm is None else u_mm)
    for angle_deg in angles_deg:
        shown = yield from turning.shown(angle_deg, proof.so_far())
        proof.add(*shown, in_space=in_space)
    for _ in range(MOST_MORE):
        doubted = proof.undecided()
        if doubted is None:
            break
        yield Notify(proof.told(doubted))
        shown = yield from turning.shown(doubted.u_deg, proof.so_far())
        proof.add(*shown, in_space=in_space)
    from robolink.calibration import height_shows_from_mm  # numpy, imported only when used

    heights_mm = [contact.z_mm, *(touch.z_mm for touch in proof.touches)]
    sigma_z_mm = plan.sigma_in_height_mm
    return replace(
        proof.result(heights_agree(heights_mm, sigma_z_mm)),
        height_shows_from_mm=height_shows_from_mm(len(heights_mm), sigma_z_mm),
    )


def _nearer(u_deg: float, angle_deg: float) -> float:
    """Return an angle two thirds of the way from where the tool was measured."""
    return u_deg + (angle_deg - u_deg) * 2 / 3


class _Turning:
    """Moves the new tip back to the pin at angles of U.

    Args:
        plan: Lift, clearance, contact input.
        contact: Pose of the new tool's tip on the pin.
        limit_mm: Largest drift that passes.
        written: The active offset.
        tip: Where the tip was found.
    """

    def __init__(
        self,
        plan: TouchPlan,
        contact: Pose,
        limit_mm: float,
        written: ToolOffset,
        tip: ToolOffset,
    ) -> None:
        self._plan, self._contact, self._limit_mm = plan, contact, limit_mm
        self._written, self._tip = written, tip
        self._touches = PinTouches(plan, limit_mm=limit_mm)
        self._count = 0

    def shown(
        self, angle_deg: float, earlier: tuple[AngleShown, ...] = ()
    ) -> Procedure[tuple[Pose, TouchedAt]]:
        """Let a person touch the pin; returns where the tip should have been, and where it was."""
        self._touches.tell_of(earlier)
        place = place_on_pin(self._contact, angle_deg, self._written, self._tip)
        found = yield from self._touches.again(
            place,
            key=self._count,
            turning=tr("Turning about the new tip."),
            instruction=tr("Jog the tip onto the pin again. robolink measures how far off it was."),
        )
        self._count += 1
        return place, found

    def on_paper(self, angles_deg: Sequence[float]) -> Procedure[None]:
        """Take all, by the preview."""
        nominal = replace(self._plan, nominal=True)
        paper = _Turning(nominal, self._contact, self._limit_mm, self._written, self._tip)
        for angle_deg in angles_deg:
            yield from paper.shown(angle_deg)


def contact_pose(result: CalibrationResult, *, tool: int) -> Pose:
    """Return the pose of the proposed tool's tip on the reference point.

    Height and angle are those of the last pose, seen through the proposed offset.
    """
    x_mm, y_mm = result.reference_point_mm[:2]
    last = tip_pose(plain_pose(result.inputs[-1]), result.offset, tool=tool)
    return replace(last, x_mm=x_mm, y_mm=y_mm)


def drift_uncertainty_mm(result: CalibrationResult) -> float:
    """Return the standard uncertainty of the drift that one touch shows.

    A scatter that was estimated from few touches is itself too uncertain to make it smaller.
    """
    sigma_mm = result.sigma_mm
    if sigma_mm is None:
        return PERSON_U_DRIFT_MM
    if result.sigma_stated or (result.dof or 0) >= _ENOUGH_DOF:
        return sigma_mm
    return max(sigma_mm, PERSON_U_DRIFT_MM)


_ENOUGH_DOF: Final = 4


@dataclass(slots=True)
class DriftProof:
    """What the touches of a turn test have shown so far.

    Attributes:
        tolerance_mm: Largest drift that passes, with its guard band.
        u_mm: Standard uncertainty of the drift that one touch shows.
        touches: Those made, in their order.
    """

    tolerance_mm: float
    u_mm: float
    touches: list[TouchedAt] = field(default_factory=list)
    _apart: dict[float, list[tuple[float, float, float]]] = field(default_factory=dict)
    _in_space: bool = False

    def add(self, place: Pose, found: TouchedAt, *, in_space: bool = False) -> None:
        """Add a touch.

        Args:
            place: Where the tip should have been.
            found: Where it was.
            in_space: Whether its height counts as drift, too.

        Example:
            >>> from robolink.model import Pose
            >>> from robolink.procedures import DriftProof
            >>> from robolink.runner import TouchedAt
            >>> proof = DriftProof(tolerance_mm=0.2, u_mm=0.02)
            >>> proof.add(Pose(310, 95, -40, 90), TouchedAt.of(Pose(310.3, 95.4, -40, 90)))
            >>> shown = proof.result()
            >>> shown.passed, round(shown.max_drift_mm, 3)
            (False, 0.5)
        """
        self.touches.append(found)
        self._in_space = self._in_space or in_space
        dz_mm = found.z_mm - place.z_mm if in_space else 0.0
        apart = (found.x_mm - place.x_mm, found.y_mm - place.y_mm, dz_mm)
        self._apart.setdefault(place.u_deg, []).append(apart)

    def undecided(self) -> Drift | None:
        """Return the drift that needs another touch; none if one is certainly outside."""
        drifts = self._drifts()
        verdicts = [self._judged(one) for one in drifts]
        if DriftVerdict.FAILED in verdicts or DriftVerdict.UNDECIDED not in verdicts:
            return None
        return drifts[verdicts.index(DriftVerdict.UNDECIDED)]

    def so_far(self) -> tuple[AngleShown, ...]:
        """Return what each angle has shown by itself, judged as in the end, in their order."""
        within = {DriftVerdict.PASSED: True, DriftVerdict.FAILED: False}
        return tuple(
            AngleShown(one.u_deg, one.distance_mm, within.get(self._judged(one)))
            for one in self._drifts()
        )

    def _judged(self, drift: Drift) -> DriftVerdict:
        return judge_drift(drift.distance_mm, drift.u_mm, self.tolerance_mm)

    def told(self, drift: Drift) -> str:
        """Return why it is touched again."""
        return tr(
            "At U {u:.1f} the tip is {drift:.3f} mm off, too near the limit of {limit:.3f} "
            "mm. Touch once more there; the mean counts.",
            u=drift.u_deg,
            drift=drift.distance_mm,
            limit=self.tolerance_mm,
        )

    def result(self, heights_agree: bool = True) -> VerifyResult:
        """Return their joint result."""
        return VerifyResult(
            self._drifts(),
            self.tolerance_mm,
            codes=() if heights_agree else ("touch_heights_differ",),
            inputs=tuple(self.touches),
            in_space=self._in_space,
        )

    def _drifts(self) -> tuple[Drift, ...]:
        """Return the mean drift at each angle; a mean of n scatters less by the root of n."""
        drifts = []
        for angle_deg, apart in self._apart.items():
            dx_mm, dy_mm, dz_mm = (sum(axis) / len(apart) for axis in zip(*apart, strict=True))
            u_mm = self.u_mm / math.sqrt(len(apart))
            drifts.append(Drift(angle_deg, dx_mm, dy_mm, dz_mm, u_mm, len(apart)))
        return tuple(drifts)


def place_on_pin(contact: Pose, angle_deg: float, written: ToolOffset, tip: ToolOffset) -> Pose:
    """Return where the selected frame should be with the tip on the pin.

    Args:
        contact: Pose of the new tool's tip on the pin.
        angle_deg: Tool angle U.
        written: The active offset.
        tip: Where the tip was found.
    """
    frame = replace(contact, u_deg=angle_deg)
    aside_x, aside_y = FlangePlane.of(flange_of(frame, written)).in_base(
        written.x_mm - tip.x_mm, written.y_mm - tip.y_mm, written.z_mm - tip.z_mm
    )
    return replace(frame, x_mm=contact.x_mm + aside_x, y_mm=contact.y_mm + aside_y)


_MOVES_PER_ANGLE = 3
"""Movements per angle: over the pin, down beside it, and off it again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnTest(KeptProof):
    """All that a turn test at a pin needs; nothing of it is read from the robot.

    Attributes:
        touch: Lift, clearance, contact input.
        contact: Pose of the new tool's tip on the pin, as the measurement implies it.
        angles_deg: Tool angles U at which the tip is brought back onto the pin.
        u_mm: Standard uncertainty of the drift that one touch shows.
        in_space: Whether the height of a touch counts as drift.
    """

    method: ClassVar[str] = "two-pose"

    touch: TouchPlan
    contact: Pose
    angles_deg: tuple[float, ...]
    u_mm: float
    in_space: bool = False

    def moves(self, here: Pose) -> int:  # noqa: ARG002 - it begins where the person touches
        """Return how many movements there are; see :meth:`KeptProof.moves`."""
        return 1 + _MOVES_PER_ANGLE * len(self.angles_deg)

    def foreseen(self, here: Pose) -> Procedure[VerifyResult] | None:  # noqa: ARG002 - as for moves
        """Return its steps, each stop at its highest; see :meth:`KeptProof.foreseen`."""
        return replace(self, touch=replace(self.touch, nominal=True)).steps()

    def prove(self, context: MeasurementContext) -> VerifyResult:
        """Make it; see :meth:`KeptProof.prove`."""
        return context.run(self.steps(), tip=self.written)

    def prove_after_a_break(self, context: MeasurementContext) -> VerifyResult:
        """Make it; see :meth:`KeptProof.prove_after_a_break`."""
        return context.run(self.steps_after_a_break(), tip=self.written)

    def steps(self) -> Procedure[VerifyResult]:
        """Return the steps right after the measurement: the tip is lifted and over the pin.

        Raises:
            CalibrationError, LimitError: As :func:`~robolink.procedures.verify_by_turning`.
        """
        return verify_by_turning(
            self.touch,
            contact=self.contact,
            angles_deg=self.angles_deg,
            tolerance_mm=self.tolerance_mm,
            u_mm=self.u_mm,
            written=self.written,
            tip=self.tip,
            in_space=self.in_space,
        )

    def steps_after_a_break(self) -> Procedure[VerifyResult]:
        """Return the steps when the place of the tip is no longer known.

        A person brings it onto the pin first, so that the first movement that the robot makes by
        itself is straight up from there. A place farther from the measured one than the clearance
        ends the test at once, failed: the robot would come down too near, or at another pin.

        Raises:
            CalibrationError, LimitError: As :func:`~robolink.procedures.verify_by_turning`.
        """
        first = yield from PinTouches(self.touch, limit_mm=self.touch.clearance_mm).first()
        place = place_on_pin(self.contact, first.u_deg, self.written, self.tip)
        apart = (first.x_mm - place.x_mm, first.y_mm - place.y_mm, first.z_mm - place.z_mm)
        if math.hypot(*apart) > self.touch.clearance_mm:
            limit_mm = min(self.tolerance_mm, self.touch.clearance_mm)
            drift = Drift(first.u_deg, *apart, self.u_mm)
            return VerifyResult((drift,), limit_mm, inputs=(first,))
        # The arm stays as the person left it; its hand must not change over the pin.
        contact = replace(self.contact, hand=first.hand, posture=first.posture)
        return (yield from replace(self, contact=contact).steps())
