"""The simulated arm: where it is at any instant, and its commands.

A motion is a row of legs whose end is known when it starts. Stopping freezes the arm where it
is (assumed: a real one needs a few milliseconds to come to rest).
"""

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Final

from robolink.model import Hand, Pose, Posture, ToolOffset
from robolink.timing import NS_PER_S
from robolink_simulators.device.wire_record import Place
from robolink_simulators.epson.arm.kinematics import forward, hand_of, posture_of, tip_of
from robolink_simulators.epson.arm.robots import Joints, Mechanism, RobotModel, check_ranges
from robolink_simulators.epson.arm.tilted_legs import plan_line
from robolink_simulators.epson.arm.trajectory import (
    JointLeg,
    JointPace,
    Leg,
    LineLeg,
    LinePace,
    plan_go,
)

_REST: Final = {
    Mechanism.SCARA: Joints(45.0, 60.0, 0.0, -105.0),
    Mechanism.FOLDED_SCARA: Joints(45.0, -120.0, 0.0, 75.0),
}
_ON_A_TABLE: Final = Joints(0.0, -35.0, 5.0, 0.0, -60.0, 0.0)
_UNDER_A_CEILING: Final = Joints(0.0, 10.0, 0.0, 0.0, 80.0, 0.0)

_LOOK_BACK_NS = 1_000_000
_STILL = 1e-9

_Ways = tuple[float, ...]


@dataclass(slots=True)  # not frozen: each motion makes one, in a third of the time
class Travelled:
    """A motion, or its part until it was stopped or observed.

    Attributes:
        start_ns: When it began.
        end_ns: When it ended.
        joints_at: Tells the commanded joints at an instant between the two.
        complete: Whether it went as far as it was to go.
    """

    start_ns: int
    end_ns: int
    joints_at: Callable[[int], Joints]
    complete: bool


@dataclass(slots=True)
class _Travel:
    start_ns: int
    legs: tuple[Leg, ...]
    ends_ns: tuple[int, ...] = field(init=False)
    end_ns: int = field(init=False)

    def __post_init__(self) -> None:
        # Calculated once: each poll of a movement reads them several times.
        totals = accumulate(leg.duration_ns for leg in self.legs)
        self.ends_ns = tuple(self.start_ns + total for total in totals)
        self.end_ns = self.ends_ns[-1] if self.ends_ns else self.start_ns

    def looks(self, since_ns: int, now_ns: int) -> list[int]:
        """Return when to observe the joints so that each one's last direction is seen."""
        if now_ns <= since_ns:
            return []
        instants = {t for end in (*self.ends_ns, now_ns) for t in (end - _LOOK_BACK_NS, end)}
        return sorted(t for t in instants if since_ns < t <= now_ns)

    def braked(self, now_ns: int) -> "_Travel":
        """Return the same travel, left at ``now_ns`` to come to rest."""
        began_ns, kept = self.start_ns, list[Leg]()
        for leg in self.legs:
            if now_ns < began_ns + leg.duration_ns:
                kept.append(leg.braked(now_ns - began_ns))
                break
            kept.append(leg)
            began_ns += leg.duration_ns
        return _Travel(self.start_ns, tuple(kept))

    def joints_at(self, now_ns: int) -> Joints:
        leg, elapsed_ns = self._leg_at(now_ns)
        return leg.joints_at(elapsed_ns)

    def flange_at(self, now_ns: int) -> Pose:
        leg, elapsed_ns = self._leg_at(now_ns)
        return leg.flange_at(elapsed_ns)

    def until(self, end_ns: int) -> "Travelled":
        """Return the part of the motion up to an instant, as far as it goes."""
        end_ns = min(end_ns, self.end_ns)
        return Travelled(self.start_ns, end_ns, self.joints_at, end_ns == self.end_ns)

    def leg_at(self, now_ns: int) -> Leg:
        return self._leg_at(now_ns)[0]

    def within_until(self, now_ns: int, room_mm: float) -> int:
        leg, elapsed_ns = self._leg_at(now_ns)
        top_mm_s = leg.top_mm_s if isinstance(leg, LineLeg) else None
        if top_mm_s is None:
            return now_ns
        left_ns = max(0, leg.duration_ns - elapsed_ns)
        return now_ns + min(left_ns, int(room_mm / max(top_mm_s, _STILL) * NS_PER_S))

    def _leg_at(self, now_ns: int) -> tuple[Leg, int]:
        elapsed_ns = max(0, now_ns - self.start_ns)
        for leg in self.legs[:-1]:
            if elapsed_ns < leg.duration_ns:
                return leg, elapsed_ns
            elapsed_ns -= leg.duration_ns
        return self.legs[-1], elapsed_ns


def rest_of(model: RobotModel) -> Joints:
    """Return where a new arm is (assumed).

    A SCARA is bent to the right, fully up, with U 0; six axes hold the tool straight down in front
    of the base, away from every singularity.
    """
    if model.six_axes:
        return _UNDER_A_CEILING if model.hangs else _ON_A_TABLE
    return _REST[model.mechanism]


class Arm:
    """One arm in simulated time.

    Args:
        model: Which robot.
        joints: Where it stands; by default as :func:`rest_of` says.
        backlash_deg: Play of every turning joint behind the encoder: the true joint trails the
            commanded one by half of it, against the way it last turned (assumed model).

    Attributes:
        moves_started: Motions begun since the arm was made; a repeated command shows here.
        on_started: Told when each motion begins, and of what tells where its flange is to end.
        backlash_mm: Play of a SCARA's joint 3, likewise; none at first.
        travelled_until_ns: Until when the motion under way has gone, or the last one went.
        followed: Told of each part of a motion, from when to when, before its end is forgotten.
        added_in_force: Whether motions are of an added arm; what is mounted stays on the own one.
        on_travelled: Told of each motion when it is over.
        guard: Cuts the legs of a motion short where the drives would stop it.
        origin_errors: How far each joint really stands from where its encoder is taken to say.
    """

    def __init__(
        self, model: RobotModel, joints: Joints | None = None, *, backlash_deg: float = 0.0
    ) -> None:
        joints = rest_of(model) if joints is None else joints
        check_ranges(model, joints)
        self.model = model
        self.moves_started = 0
        self.on_started: Callable[[int, Callable[[], Place]], None] = _unnoted
        self.backlash_deg = backlash_deg
        self.backlash_mm = 0.0
        self.followed: Callable[[int, int], None] | None = None
        self.added_in_force = False
        self.on_travelled: Callable[[Travelled], None] = _heedless
        self.guard: Callable[[Sequence[Leg]], Sequence[Leg]] = _whole
        self.origin_errors: tuple[float, ...] = (0.0,) * model.axes
        self._joints = joints
        self._now_ns = 0
        self.travelled_until_ns = 0
        self._travel: _Travel | None = None
        self._seen: tuple[_Travel, int, Pose] | None = None
        self._turned: _Ways = (0.0,) * model.axes

    @property
    def joints(self) -> Joints:
        """The commanded joints at the instant last given to :meth:`advance`."""
        return self._joints

    @property
    def now_ns(self) -> int:
        """The instant last given."""
        return self._now_ns

    @property
    def moving(self) -> bool:
        """Whether a motion is in progress."""
        return self._travel is not None

    @property
    def true_joints(self) -> Joints:
        """Where the joints really are: commanded, minus backlash and false zeros. No noise."""
        return self._trailing(self._joints, self._turned)

    @property
    def leg(self) -> Leg | None:
        """The leg of the motion in progress, ``None`` at rest."""
        return None if self._travel is None else self._travel.leg_at(self._now_ns)

    def flange(self) -> Pose:
        """Return the commanded flange pose."""
        return forward(self.model, self._joints)

    def true_flange(self) -> Pose:
        """Return the flange pose that a pin, a camera or a light beam meets."""
        return forward(self.model, self.true_joints)

    def true_flange_at(self, now_ns: int) -> Pose:
        """Return where the flange will really be, or was, in the motion in progress."""
        if self._travel is None:
            return self.true_flange()
        if not self.backlash_deg and not self.backlash_mm and not any(self.origin_errors):
            return self._seen_at(self._travel, now_ns)
        before, then = (self._travel.joints_at(t) for t in (now_ns - _LOOK_BACK_NS, now_ns))
        return forward(self.model, self._trailing(then, self._ways(before, then)))

    def within_until(self, now_ns: int, room_mm: float) -> int:
        """Return until when nothing that it carries leaves a place, nor turns.

        Args:
            now_ns: An instant of the motion in progress; it is returned where more is not known.
            room_mm: How far from where it is at that instant the place reaches.
        """
        exact = not (self.backlash_deg or self.backlash_mm or any(self.origin_errors))
        if self._travel is None or self.added_in_force or not exact or room_mm <= 0.0:
            return now_ns
        return self._travel.within_until(now_ns, room_mm)

    def _seen_at(self, travel: _Travel, now_ns: int) -> Pose:
        """Return where the flange is; a search asks in each millisecond, once for each beam."""
        if self._seen is None or self._seen[0] is not travel or self._seen[1] != now_ns:
            if self.added_in_force:
                flange = forward(self.model, travel.joints_at(now_ns))
            else:
                flange = travel.flange_at(now_ns)
            self._seen = (travel, now_ns, flange)
        return self._seen[2]

    def real_position(
        self, rng: random.Random, noise_mm: float, model: RobotModel | None = None
    ) -> Pose:
        """Return the flange pose as RealPos measures it; ``model`` has the present arm.

        Encoders sit before the play, so backlash does not show; X, Y and Z scatter with the
        standard deviation ``noise_mm`` (seen in a transcript: 2 um, docs/reference/epson.md 6,
        vector 11).
        """
        pose, scattered = forward(model or self.model, self._joints), rng.gauss
        return Pose(
            scattered(pose.x_mm, noise_mm),
            scattered(pose.y_mm, noise_mm),
            scattered(pose.z_mm, noise_mm),
            pose.u_deg,
            pose.v_deg,
            pose.w_deg,
            hand=pose.hand,
            tool=pose.tool,
            posture=pose.posture,
        )

    def plan_go(self, target: Joints, pace: JointPace, *, radius_mm: float = 0.0) -> JointLeg:
        """Plan a joint-space motion from here; see :func:`trajectory.plan_go`."""
        return plan_go(self.model, self._joints, target, pace, radius_mm=radius_mm)

    def plan_move(self, target: Pose, pace: LinePace, *, offset: ToolOffset | None = None) -> Leg:
        """Plan a straight motion of the tip from here; see :func:`tilted_legs.plan_line`."""
        ends = (tip_of(self.model, self.flange(), offset), target)
        return plan_line(self.model, ends, pace, offset=offset, near=self._joints)

    @property
    def hand(self) -> Hand:
        """The arm's present hand."""
        return hand_of(self.model, self._joints)

    @property
    def posture(self) -> Posture | None:
        """The arm's present elbow, wrist and joint flags, ``None`` where it has none."""
        return posture_of(self.model, self._joints)

    def start(self, legs: Sequence[Leg], now_ns: int) -> int:
        """Begin a motion made of ``legs`` and return the instant at which it ends."""
        self.halt(now_ns)
        legs = self.guard(legs)
        last = legs[-1]
        self.moves_started += 1
        self.on_started(self._now_ns, lambda: _place(last.flange_at(last.duration_ns)))
        self._travel = _Travel(self._now_ns, tuple(legs))
        return self._travel.end_ns

    def position_at(self, now_ns: int) -> Joints:
        """Return the commanded joints at an instant not before the last one given."""
        return self._joints if self._travel is None else self._travel.joints_at(now_ns)

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""
        since_ns, self._now_ns = self._now_ns, max(self._now_ns, now_ns)
        if self._travel is None:
            return
        self.travelled_until_ns = min(self._now_ns, self._travel.end_ns)
        if self.followed is not None:
            self.followed(since_ns, self.travelled_until_ns)
        for instant_ns in self._travel.looks(since_ns, self._now_ns):
            self._take_up(self._travel.joints_at(instant_ns))
        if self._now_ns >= self._travel.end_ns:
            self._end()

    @property
    def under_way(self) -> Travelled | None:
        """The travelled part of the motion in progress, ``None`` at rest."""
        return None if self._travel is None else self._travel.until(self._now_ns)

    def next_change(self) -> int | None:
        """Return when the motion in progress ends, ``None`` at rest."""
        return None if self._travel is None else self._travel.end_ns

    def brake(self, now_ns: int) -> int:
        """Stop with the motion's own deceleration; return when it has stopped."""
        if self._travel is None:
            return now_ns
        self._travel = self._travel.braked(now_ns)
        return self._travel.end_ns

    def halt(self, now_ns: int) -> None:
        """Stop where the arm is."""
        self.advance(now_ns)
        self._end()

    def _end(self) -> None:
        travelled = self.under_way
        self._travel = None
        if travelled is not None:
            self.on_travelled(travelled)

    def place(self, joints: Joints, now_ns: int) -> None:
        """Put the arm somewhere by hand or pendant: not a motion that a program started.

        Raises:
            OutOfReach: A joint would leave its range.
        """
        check_ranges(self.model, joints)
        self.halt(now_ns)
        self._take_up(joints)

    def tell_elsewhere(self, joints: Joints) -> None:
        """Treat the arm, which stays where it is, as if it were elsewhere.

        Raises:
            OutOfReach: A joint would stand outside its range.
        """
        check_ranges(self.model, joints)
        self._joints = joints

    def _take_up(self, joints: Joints) -> None:
        self._turned = self._ways(self._joints, joints)
        self._joints = joints

    def _ways(self, before: Joints, after: Joints) -> _Ways:
        """Return in which direction each joint last turned, from one pose to the other."""
        changes = zip(before, after, self._turned, strict=True)
        return tuple(
            [
                way if abs(new - old) < _STILL else math.copysign(1.0, new - old)
                for old, new, way in changes
            ]
        )

    def _trailing(self, joints: Joints, ways: _Ways) -> Joints:
        plays = [self.backlash_deg / 2] * len(joints)
        for number in self.model.linear_joints:
            plays[number - 1] = self.backlash_mm / 2
        trails = zip(joints, plays, ways, self.origin_errors, strict=True)
        return Joints(*(value - play * way + error for value, play, way, error in trails))


def _heedless(travelled: Travelled) -> None:
    """Do nothing: nobody measures the drives."""


def _unnoted(at_ns: int, flange_mm: Callable[[], Place]) -> None:
    """Do nothing: nobody notes the motions."""


def _whole(legs: Sequence[Leg]) -> Sequence[Leg]:
    """Return the legs unchanged: nothing stops the drives."""
    return legs


def _place(flange: Pose) -> Place:
    return flange.x_mm, flange.y_mm, flange.z_mm
