"""Touch-off on a surface that switches an input. The tip stops at the touch, then retreats."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import fmean
from typing import ClassVar, Self

from robolink.calibration import (
    USUAL_DECELERATION_MM_S2,
    CalibrationResult,
    Drift,
    FlangePlane,
    Touch,
    VerifyResult,
    ZTouchResult,
    carrying,
    height_of,
    seen_from,
    solvable_planes,
    solve_z_touch,
    touch_sigma_gain,
)
from robolink.messages import tr
from robolink.methods.z_touch import ZTouchParameters, ZTouchSource
from robolink.model import Path, Pose, ToolOffset, checks_arguments
from robolink.procedures import (
    NO_OFFSET,
    PlacedProof,
    approach_path,
    offset_z,
    sample_sequentially,
    seek_or_retract,
)
from robolink.procedures.samples import TouchNames
from robolink.runner import Move, Procedure, Seek
from robolink.stations import TouchStation


def touch_surface(
    source: ZTouchSource, stored: ToolOffset | None, here: Pose
) -> Procedure[ZTouchResult]:
    """Measure as a source says; see :func:`~robolink.methods.measure_z_touch`."""
    solvable_planes([here], height_of(stored))
    probing = _ZTouchSampler(source, here, stored or NO_OFFSET, here, stored, here)
    speeds_mm_s = source.plan.speeds_mm_s
    first = yield from probing.take(speeds_mm_s[0])
    return (yield from sample_sequentially(probing, first, speeds_mm_s, source.plan.sampling))


@dataclass(frozen=True, slots=True)
class TriggerLag:
    """By how much a trigger comes late, as a measurement found it.

    Attributes:
        latency_s: Its latency.
        overshoot_s2_per_mm: How far the robot moves while it brakes, per square of the speed, where
            three speeds showed it; else 0.
    """

    latency_s: float
    overshoot_s2_per_mm: float = 0.0

    @classmethod
    def of(cls, result: CalibrationResult) -> Self | None:
        """Return what a measurement found; ``None`` if it is none by touches."""
        if not isinstance(result, ZTouchResult):
            return None
        return cls(result.latency_s, result.overshoot_s2_per_mm or 0.0)

    def height_mm(self, touch: Touch, deceleration_mm_s2: float | None) -> float:
        """Return the height of the frame when the tip met the surface.

        Args:
            touch: Where it was when the trigger was read, and at which speed.
            deceleration_mm_s2: How the robot brakes, where its controller told it.
        """
        braking = 0.0 if deceleration_mm_s2 is None else 1 / (2 * deceleration_mm_s2)
        per_square = braking + self.overshoot_s2_per_mm
        return touch.z_mm + touch.speed_mm_s * (self.latency_s + touch.speed_mm_s * per_square)


def _speeds_of_test(plan: ZTouchParameters, trigger: TriggerLag | None) -> tuple[float, ...]:
    """Return the speeds of the touches of a test; those of the plan need the trigger to be known.

    Otherwise it touches as the measurement does.
    """
    stated = plan.test_speeds_mm_s
    return plan.speeds_mm_s if stated is None or trigger is None else stated


@checks_arguments
def verify_by_touching(
    station: TouchStation,
    plan: ZTouchParameters,
    *,
    here: Pose,
    angles_deg: Sequence[float],
    tolerance_mm: float,
    aside: ToolOffset = NO_OFFSET,
    deceleration_mm_s2: float | None = None,
    step_mm: float | None = None,
    trigger: TriggerLag | None = None,
) -> Procedure[VerifyResult]:
    """Turn about the new tip and touch the surface there again. Runs in the new tool.

    Args:
        station: Where the surface is.
        plan: How it is touched.
        here: Where the frame of the new tool is.
        angles_deg: Its angles U at which the surface is touched.
        tolerance_mm: Largest drift that passes.
        aside: Where the tip is expected, seen from the selected frame; not 0 where a difference
            to a reference was written.
        deceleration_mm_s2: As for :func:`~robolink.methods.measure_z_touch`.
        step_mm: Likewise.
        trigger: By how much the measurement found that the trigger comes late, for touches at the
            speeds that the plan states for the test; without it the test finds that anew.

    Raises:
        CalibrationError: As :func:`~robolink.methods.measure_z_touch`.

    Example:
        >>> from robolink.methods import ZTouchParameters, verify_by_touching
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.stations import TouchStation
        >>> from robolink.testing import PaperCell
        >>> plate, tip = TouchStation(320, 60, -50, input=5), Pose(320, 60, -20, 0)
        >>> proof = verify_by_touching(
        ...     plate, ZTouchParameters(), here=tip, angles_deg=(0, 90), tolerance_mm=0.05
        ... )
        >>> on_the_plate = {5: lambda at: at[2] < -50}
        >>> shown = PaperCell(tip, ToolOffset(0, 0, -0.02), switches=on_the_plate).run(proof)
        >>> shown.heights_only, round(shown.max_drift_mm, 3)
        (True, 0.02)
    """
    source, drifts = ZTouchSource(station, plan, None, deceleration_mm_s2, step_mm), list[Drift]()
    for angle_deg in angles_deg:
        frame = replace(here, u_deg=angle_deg)
        probing = _ZTouchSampler(source, frame, aside, here)
        touches = []
        for speed_mm_s in _speeds_of_test(plan, trigger):
            touches.append((yield from probing.take(speed_mm_s)))
        yield from probing.away()
        here = probing.here
        if trigger is None:
            height_mm = probing.solve(touches).flange_z_mm
        else:
            height_mm = fmean(trigger.height_mm(touch, deceleration_mm_s2) for touch in touches)
        rise_mm = FlangePlane.of(probing.frame).rise_mm(aside)
        drifts.append(Drift(angle_deg, 0.0, 0.0, height_mm + rise_mm - station.z_mm))
    return VerifyResult(tuple(drifts), tolerance_mm, heights_only=True)


@dataclass(slots=True)
class _ZTouchSampler(TouchNames):
    """Touches of a surface, each at a speed; implements ``SequentialSampler``.

    Attributes:
        source: Where and how.
        frame: A pose of the frame: its angles, hand, local and tool.
        tip: Where the tip is expected, seen from the frame.
        here: Where the frame is.
        stored: The offset stored now, in a measurement.
        flange: A pose of the flange, where the frame is the flange: Z is along its axis.
        near: Whether the frame is at the clearance or below, not above the surface.
    """

    source: ZTouchSource
    frame: Pose
    tip: ToolOffset
    here: Pose
    stored: ToolOffset | None = None
    flange: Pose | None = None
    near: bool = False

    @property
    def known(self) -> str:
        return tr("Z")

    def take(self, place: float) -> Procedure[Touch]:
        if not self.near:
            # From above in one movement: in between nothing is met that is not met below.
            high = replace(self._above, z_mm=max(self._safe.z_mm, self.here.z_mm))
            yield from approach_path(high, here=self.here, purpose=tr("Moving above the surface."))
            self.here = yield Move(
                self._above, Path.STRAIGHT, tr("Lowering to just above the place.")
            )
            self.near = True
        plan, edge = self.source.plan, self.source.station.edge
        end = offset_z(self._above, -plan.clearance_mm - plan.beyond_mm)
        step = Seek(
            end,
            edge,
            place,
            tr("Looking for the surface."),
            expected=offset_z(self._above, -plan.clearance_mm),
        )
        touch = yield from seek_or_retract(step, here=self.here, safe_z_mm=self._safe.z_mm)
        self.here = yield Move(offset_z(touch, plan.back_off_mm), Path.STRAIGHT, tr("Backing off."))
        return Touch(touch.z_mm, place)

    def away(self) -> Procedure[None]:
        if self.near:
            self.here = yield Move(self._safe, Path.STRAIGHT, tr("Lifting off the surface."))
            self.near = False

    def solve(self, touches: Sequence[Touch]) -> ZTouchResult:
        return solve_z_touch(
            touches,
            self.source.station.z_mm,
            stored=self.stored,
            flange=self.flange,
            sigma_mm=self.source.sigma_mm,
            deceleration_mm_s2=self.source.deceleration_mm_s2 or USUAL_DECELERATION_MM_S2,
            deceleration_told=self.source.deceleration_mm_s2 is not None,
            step_mm=self.source.step_mm,
        )

    def foreseen(self, place: float) -> Touch:
        return Touch(0.0, place)

    def gain(self, touches: Sequence[Touch]) -> float:
        return touch_sigma_gain(touches)

    def named(self, touch: Touch) -> str:
        return tr("{speed:g} mm/s", speed=touch.speed_mm_s)

    @property
    def _above(self) -> Pose:
        """The frame's pose with the tip where the search starts."""
        station = self.source.station
        at = (station.x_mm, station.y_mm, station.z_mm + self.source.plan.clearance_mm)
        return carrying(self.frame, self.tip, at)

    @property
    def _safe(self) -> Pose:
        """The frame's pose with the tip above the surface, where it may turn."""
        return offset_z(self._above, self.source.plan.lift_mm - self.source.plan.clearance_mm)


@dataclass(frozen=True, slots=True, kw_only=True)
class ProbeTest(PlacedProof):
    """All that the test on a switching surface needs.

    Attributes:
        station: Where the surface is.
        plan: How it is touched.
        angles_deg: U of the new tool at which it is.
        deceleration_mm_s2: How the robot brakes, where its controller told it.
        step_mm: How finely it tells where the input switched, likewise.
        trigger: By how much the measurement found that the trigger comes late; ``None`` where the
            test finds that anew.
    """

    method: ClassVar[str] = "z-touch"
    by_touch: ClassVar[bool] = False

    station: TouchStation
    plan: ZTouchParameters
    angles_deg: tuple[float, ...]
    deceleration_mm_s2: float | None
    step_mm: float | None = None
    trigger: TriggerLag | None = None

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from wherever the frame is."""
        return verify_by_touching(
            self.station,
            self.plan,
            here=here,
            angles_deg=self.angles_deg,
            tolerance_mm=self.tolerance_mm,
            aside=seen_from(self.written, self.tip),
            deceleration_mm_s2=self.deceleration_mm_s2,
            step_mm=self.step_mm,
            trigger=self.trigger,
        )
