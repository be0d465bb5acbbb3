"""The meaning of the controller's answers: refusals, status flags, commands not sent.

What a look before a movement shows, and what was in force before a procedure.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

from robolink.errors import (
    NotReadyError,
    NotReadyReason,
    RejectedError,
)
from robolink.messages import tr
from robolink.model import ControllerStatus, MotionProfile, Path
from robolink.protocols import spel
from robolink.protocols.epson_text import ErrorCode, Refusal, StatusFlags

NOT_EXECUTED = frozenset({10, 11, 12, 13, 14, 15, 16, 20, 21})
"""Refusals that show that nothing was carried out (docs/reference/epson.md 1.6); 19 and 99 do not
show it."""

NOT_NOW: Final = frozenset({20, 21})
"""Refusals that mean only that the controller is busy (docs/reference/epson.md 1.6)."""


def rejected(refusal: Refusal, *, controller: str, request: str = "") -> RejectedError:
    """Return the error for a refusal, in words, with its remedy."""
    try:
        meaning = ErrorCode(refusal.code).meaning
    except ValueError:
        meaning = tr("a code that is not in the manual")
    return RejectedError(
        tr(
            "The controller refused {name} with code {code}: {meaning}.",
            name=request or refusal.name,
            code=refusal.code,
            meaning=meaning,
        ),
        code=refusal.code,
        remedy=_remedy(refusal.code),
        controller=controller,
        request=request or refusal.name,
    )


def _remedy(code: int) -> str:
    if code == 20:
        return tr("Run 'robolink status' to see which condition is missing.")
    if code == 21:
        return tr("Wait for the running statement, or stop it.")
    if code == 11:
        return tr(
            "Connect again to log in. If the controller refuses again, its firmware does "
            "not know the command."
        )
    return tr("robolink did not repeat it. Check before you continue: robolink status")


def status_from_flags(flags: StatusFlags, code: int) -> ControllerStatus:
    """Translate EPSON's flags into the words all controllers share.

    Source: docs/reference/epson.md 1.4.
    """
    return ControllerStatus(
        remote=flags.auto,
        ready=flags.ready,
        running=flags.running,
        paused=flags.paused,
        fault=flags.error,
        serious_fault=flags.serious_error,
        emergency_stop=flags.emergency_stop,
        guard_open=flags.safeguard,
        warning=flags.warning,
        teach=flags.teach,
        test=flags.test,
        code=code,
    )


def may_log_out(status: ControllerStatus) -> bool:
    """Return whether logging out is harmless.

    While a task runs it raises an error on the controller (docs/reference/epson.md 1.1), so the
    connection is just closed then. So it is when another device starts the cell: a task could
    begin between the look and the logout.
    """
    return status.remote and not (status.running or status.paused)


def require_ready(status: ControllerStatus, *, controller: str, request: str) -> None:
    """Refuse an Execute that the controller would refuse, naming the state.

    Raises:
        NotReadyError: The worst condition that stands in the way (docs/reference/epson.md 1.2:
            Auto, Ready, no error, no emergency stop, guard closed).
    """
    found = _obstacle(status)
    if found is None:
        return
    reason, what, remedy = found
    raise NotReadyError(
        what,
        reason=reason,
        code=status.code,
        remedy=remedy,
        controller=controller,
        request=request,
    )


def _obstacle(status: ControllerStatus) -> tuple[NotReadyReason, str, str] | None:
    stopped = _stopped(status)
    if stopped is not None:
        return stopped
    if status.teach:
        return (
            NotReadyReason.TEACH,
            tr("The controller is in TEACH: a PC cannot move it."),
            tr("Turn the key to AUTO, or teach the points on the pendant."),
        )
    if status.test:
        return (
            NotReadyReason.TEST,
            tr("The controller is in Test mode."),
            tr("Turn the mode selector to AUTO."),
        )
    if not status.remote:
        return (
            NotReadyReason.NOT_REMOTE,
            tr("The controller does not listen to this PC (the Auto flag is off)."),
            tr(
                "Set Control Device = Remote Ethernet, switch to AUTO and leave program mode in "
                "RC+; with 'use only for monitoring' ticked, only reading is possible."
            ),
        )
    return _occupied(status)


def _stopped(status: ControllerStatus) -> tuple[NotReadyReason, str, str] | None:
    if status.serious_fault:
        return (
            NotReadyReason.SERIOUS_FAULT,
            tr("The controller reports a serious error ({code:04d}).", code=status.code),
            tr("A reset does not clear it: switch the controller off and on."),
        )
    if status.emergency_stop:
        return (
            NotReadyReason.EMERGENCY_STOP,
            tr("The emergency stop is pressed, or was released without a reset."),
            tr("Remove the danger, release the emergency stop, then run 'robolink robot reset'."),
        )
    if status.fault:
        return (
            NotReadyReason.FAULT,
            tr("The controller reports an error ({code:04d}).", code=status.code),
            tr("Remove the cause, then run 'robolink robot reset'. It can switch outputs off."),
        )
    if status.guard_open:
        return (
            NotReadyReason.GUARD_OPEN,
            tr("The safety guard is open."),
            tr("Leave the cell and close the guard."),
        )
    return None


def _occupied(status: ControllerStatus) -> tuple[NotReadyReason, str, str] | None:
    if status.running:
        return (
            NotReadyReason.RUNNING,
            tr("A program is running on the controller."),
            tr("Wait until it ends, or stop the cell yourself; robolink does not stop programs."),
        )
    if status.paused:
        return (
            NotReadyReason.PAUSED,
            tr("A program is paused on the controller."),
            tr("Let it run to its end, or stop the cell."),
        )
    if not status.ready:
        return (
            NotReadyReason.STARTING,
            tr("The controller is not ready yet."),
            tr("Wait until it has started, then try again."),
        )
    return None


_SLACK: Final = 0.0005
"""Half the last digit that is sent and printed, in mm/s and mm/s^2."""


def alike(one: Sequence[float], other: Sequence[float]) -> bool:
    """Return whether a controller would print both alike."""
    return len(one) == len(other) and all(
        abs(a - b) <= _SLACK for a, b in zip(one, other, strict=True)
    )


def numbers(values: Iterable[float]) -> str:
    """Return numbers in one line, for a person."""
    return ", ".join(f"{value:g}" for value in values)


@dataclass(frozen=True, slots=True)
class PowerAndSpeed:
    """What was in force (docs/reference/spel.md 7.2).

    Attributes:
        power_high: Whether the power mode was high.
        speed_percent: Speed, with its departure and approach values.
        speed_s_mm_s: SpeedS, likewise.
        accel_s_mm_s2: AccelS, all six values; ``None`` where the cell states no acceleration, so
            that robolink sets none.
    """

    power_high: bool
    speed_percent: tuple[int, int, int]
    speed_s_mm_s: tuple[float, float, float]
    accel_s_mm_s2: tuple[float, ...] | None = None

    def is_shown_by(self, now: "PowerAndSpeed") -> bool:
        """Return whether a later reading shows the same."""
        if self.accel_s_mm_s2 is None or now.accel_s_mm_s2 is None:
            return self == now
        return replace(now, accel_s_mm_s2=self.accel_s_mm_s2) == self and alike(
            self.accel_s_mm_s2, now.accel_s_mm_s2
        )


class ArmState(NamedTuple):
    """What a movement depends on, as one look shows it.

    Attributes:
        tool: The selected tool.
        motors_on: Whether the motors are on.
        power_high: Whether the power mode is high.
        speed_percent: Speed of joint movements.
        speed_mm_s: SpeedS of straight movements.
        sensed: Whether the input that is to end the movement is on; ``None`` if there is none.
        accel_s_mm_s2: AccelS of straight movements, acceleration and deceleration; ``None`` where
            the cell states none, so that it is not read.
    """

    tool: int
    motors_on: bool
    power_high: bool
    speed_percent: int
    speed_mm_s: float
    sensed: bool | None = None
    accel_s_mm_s2: tuple[float, float] | None = None

    def differences(
        self, profile: MotionProfile, acceleration_mm_s2: float | None = None
    ) -> Iterator[spel.Statement]:
        """Yield what would make a movement one in Power Low, with the speed of its profile.

        A straight movement goes by SpeedS and AccelS, a joint movement by Speed
        (docs/reference/spel.md 7.2).

        Args:
            profile: The movement.
            acceleration_mm_s2: The highest acceleration of straight movements, where one is stated.
        """
        if self.power_high:
            yield spel.power_low()
        if profile.path is Path.STRAIGHT:
            if abs(self.speed_mm_s - profile.speed_mm_s) > _SLACK:
                yield spel.speed_s(profile.speed_mm_s)
            highest_mm_s2 = math.inf if acceleration_mm_s2 is None else acceleration_mm_s2
            if max(self.accel_s_mm_s2 or (0.0,)) > highest_mm_s2 + _SLACK:
                yield from self.lowered(acceleration_mm_s2)
        elif self.speed_percent != profile.speed_percent:
            yield spel.speed(profile.speed_percent)

    def lowered(self, acceleration_mm_s2: float | None) -> Iterator[spel.Statement]:
        """Yield what sets the stated acceleration, and raises neither of the values found."""
        if self.accel_s_mm_s2 is not None and acceleration_mm_s2 is not None:
            yield spel.accel_s(*(min(each, acceleration_mm_s2) for each in self.accel_s_mm_s2))
