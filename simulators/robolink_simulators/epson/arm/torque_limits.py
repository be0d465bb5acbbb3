"""Limits of the torque, and the end of a motion because of them.

What ends a motion because of its torque: torque control, LimitTorqueStop, CollisionDetect.

Whether it comes to that is known before the motion starts: way, load and what stands in the way
are. A drive that pushes no harder than it did when the motion began stops nothing, so that a tip
that is pressed onto something comes off it again (assumed). Source: docs/reference/spel.md 7.4.

Limits of the torque: LimitTorque, LimitTorqueStop, TC, CollisionDetect.

Source: docs/reference/spel.md 7.4.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from robolink.model import Pose
from robolink_simulators.epson.arm.joint_settings import DriveSettings
from robolink_simulators.epson.arm.robots import Joints
from robolink_simulators.epson.arm.torques import DriveObserver, JointMotion, motion_at
from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

_LOOK_EVERY_NS: Final = 2_000_000
_HARDER: Final = 1.001
_TEXTS: Final = {
    RefusalKind.TORQUE_HIGH_POWER: "A torque reached its upper limit in high power",
    RefusalKind.TORQUE_LOW_POWER: "A torque reached its upper limit in low power",
    RefusalKind.COLLISION_HIGH_POWER: "The robot has met something in high power",
    RefusalKind.COLLISION_LOW_POWER: "The robot has met something in low power",
    RefusalKind.FINE_NOT_REACHED: "The robot does not come within Fine of its target",
}


@dataclass(frozen=True, slots=True)
class TorqueLimit:
    """Torques at which a motion ends.

    Attributes:
        shares: Of each joint what its drive may give, ``None`` for whatever it needs.
        error: The error that this is, ``None`` where the motion counts as done.
        of_contact: Whether only what a thing in the way asks of the drives counts.
    """

    shares: tuple[float | None, ...]
    error: RefusalKind | None
    of_contact: bool = False


@dataclass(frozen=True, slots=True)
class CutLeg:
    """A leg that ends at once, before its path does (assumed)."""

    leg: Leg
    duration_ns: int

    def joints_at(self, elapsed_ns: int) -> Joints:
        """Return the joints that long after the start."""
        return self.leg.joints_at(min(elapsed_ns, self.duration_ns))

    def flange_at(self, elapsed_ns: int) -> Pose:
        """Return the pose of the flange that long after the start."""
        return self.leg.flange_at(min(elapsed_ns, self.duration_ns))

    def braked(self, elapsed_ns: int) -> "CutLeg":
        """Return the same leg, left to come to rest; where it was to end it ends at the latest."""
        braked = self.leg.braked(elapsed_ns)
        return CutLeg(braked, min(braked.duration_ns, self.duration_ns))


class DriveGuard:
    """Stops the motions of one robot if a drive would push too hard.

    Args:
        observer: What estimates the torques.
        limits: Tells the limits in force.

    Attributes:
        coming: The error in which the motion under way is going to end.
    """

    def __init__(
        self, observer: DriveObserver, limits: Callable[[], Sequence[TorqueLimit]]
    ) -> None:
        self.coming: RefusalKind | None = None
        self._come: RefusalKind | None = None
        self._observer, self._limits = observer, limits

    def ended(self, *, complete: bool) -> None:
        """Note that the motion is over, at its end or before."""
        self._come, self.coming = self.coming if complete else None, None

    def require_no_error(self) -> None:
        """Report once the error that ended the last motion.

        Raises:
            Refusal: That error.
        """
        error, self._come = self._come, None
        if error is not None:
            raise SpelRefusal(error, _TEXTS[error])

    def cut(self, legs: Sequence[Leg]) -> Sequence[Leg]:
        """Return the legs of a motion as far as the drives go."""
        self.coming, self._come = None, None
        for limit in self._limits():
            legs = self._cut(legs, limit)
        return legs

    def _cut(self, legs: Sequence[Leg], limit: TorqueLimit) -> Sequence[Leg]:
        allowed = self._allowed(limit, legs[0])
        for index, leg in enumerate(legs):
            at_ns = self._first_beyond(leg, allowed)
            if at_ns is not None:
                self.coming = limit.error
                return [*legs[:index], CutLeg(leg, at_ns)]
        return legs

    def _allowed(self, limit: TorqueLimit, leg: Leg) -> TorqueLimit:
        """Return a limit without the drives' torque at the start of the motion."""
        held = self._shares(limit, motion_at(lambda _: leg.joints_at(0), 0, 0))
        pairs = zip(limit.shares, held, strict=True)
        shares = tuple(None if s is None else max(s, abs(h) * _HARDER) for s, h in pairs)
        return replace(limit, shares=shares)

    def _first_beyond(self, leg: Leg, limit: TorqueLimit) -> int | None:
        """Return the first instant of a leg at which a drive would push too hard."""
        before_ns, last_ns = 0, leg.duration_ns
        while before_ns < last_ns:
            after_ns = min(before_ns + _LOOK_EVERY_NS, last_ns)
            if self._beyond(leg, after_ns, limit):
                return self._between(leg, before_ns, after_ns, limit)
            before_ns = after_ns
        return None

    def _between(self, leg: Leg, before_ns: int, after_ns: int, limit: TorqueLimit) -> int:
        while after_ns - before_ns > 1:
            middle_ns = (before_ns + after_ns) // 2
            if self._beyond(leg, middle_ns, limit):
                after_ns = middle_ns
            else:
                before_ns = middle_ns
        return after_ns

    def _beyond(self, leg: Leg, at_ns: int, limit: TorqueLimit) -> bool:
        found = self._shares(limit, motion_at(leg.joints_at, at_ns, 0))
        pairs = zip(found, limit.shares, strict=True)
        return any(most is not None and abs(share) > most for share, most in pairs)

    def _shares(self, limit: TorqueLimit, motion: JointMotion) -> tuple[float, ...]:
        if limit.of_contact:
            return self._observer.pressing(motion.now)
        return self._observer.torques(motion)


_PERCENT: Final = 100.0
_LEAST: Final = 0.01
"""A limit of 0 counts as 1 %, because a share of zero is undefined (assumed)."""

_FELT: Final = 0.05
"""Share of a drive's torque on an obstacle from which it counts as a collision (assumed). A
controller compares speeds (documented).
"""


class TorqueLimits:
    """The limits of one robot, as shares of its drives' momentary torque.

    Args:
        drives: Tells its settings.
        power_high: Tells whether its power is high.
    """

    def __init__(self, drives: Callable[[], DriveSettings], power_high: Callable[[], bool]) -> None:
        self._drives, self._power_high = drives, power_high

    def shares(self) -> tuple[float, ...]:
        """Return the highest torque of each joint in the power that is on."""
        word = "limittorque" if self._power_high() else "limittorquelp"
        return tuple(max(percent / _PERCENT, _LEAST) for percent in self._drives().get(word))

    def limits(self) -> tuple[TorqueLimit, ...]:
        """Return at which torques a motion ends.

        Collisions are not looked for under torque control (documented); that it goes before
        LimitTorqueStop is assumed.
        """
        drives, high, found = self._drives(), self._power_high(), list[TorqueLimit]()
        if drives.is_on("tc"):
            given = drives.get("tclim")
            shares = tuple(None if percent < 0 else percent / _PERCENT for percent in given)
            return (TorqueLimit(shares, None),)
        if drives.is_on("limittorquestop" if high else "limittorquestoplp"):
            error = RefusalKind.TORQUE_HIGH_POWER if high else RefusalKind.TORQUE_LOW_POWER
            found.append(TorqueLimit(self.shares(), error))
        felt = tuple(_FELT if on else None for on in drives.get("collisiondetect"))
        if any(felt):
            error = RefusalKind.COLLISION_HIGH_POWER if high else RefusalKind.COLLISION_LOW_POWER
            found.append(TorqueLimit(felt, error, of_contact=True))
        return tuple(found)
