"""Power and speed: set and read back, remembered and put back."""

from contextlib import suppress
from dataclasses import dataclass

from robolink.controllers.epson.link.window import CommandWindow
from robolink.errors import NotReadyError, NotReadyReason, UnclearAnswerError
from robolink.messages import tr
from robolink.model import MotionProfile
from robolink.protocols import spel

_SLACK = 0.0005


@dataclass(frozen=True, slots=True)
class PowerAndSpeed:
    """What was in force: power, Speed (percent) and SpeedS (mm/s), each with its
    departure and approach values (docs/reference/spel.md 7.2).
    """  # noqa: D205 - one sentence over two lines

    power_high: bool
    speed_percent: tuple[int, int, int]
    speed_s_mm_s: tuple[float, float, float]


class Settings:
    """Reads, limits and restores power and speed."""

    def __init__(self, window: CommandWindow, *, identity: str) -> None:
        self._window = window
        self._identity = identity

    def read(self) -> PowerAndSpeed:
        """Read what is in force."""
        speed = (self._speed_percent(1), self._speed_percent(2), self._speed_percent(3))
        speed_s = (self._speed_s_mm_s(1), self._speed_s_mm_s(2), self._speed_s_mm_s(3))
        return PowerAndSpeed(self.power_high(), speed, speed_s)

    def statements(self, profile: MotionProfile) -> tuple[spel.Statement, ...]:
        """Return what :meth:`slow_down` sends."""
        return (
            spel.power_low(),
            spel.speed(profile.speed_percent),
            spel.speed_s(profile.speed_mm_s),
        )

    def slow_down(self, profile: MotionProfile) -> None:
        """Set Power Low and the profile's speeds, and prove it.

        Motor On and Reset put them back, a login and Abort perhaps too (docs/reference/spel.md
        6.3), so this is done anew before each move. What the moves of this driver go by is read
        back; departure and approach values count for Jump alone, which it never sends.

        Raises:
            NotReadyError: The controller does not show what was set; nothing may move.
        """
        for statement in self.statements(profile):
            self._window.command(statement)
        speed_percent, speed_mm_s = self._speed_percent(1), self._speed_s_mm_s(1)
        if (
            self.power_high()
            or speed_percent != profile.speed_percent
            or abs(speed_mm_s - profile.speed_mm_s) > _SLACK
        ):
            raise NotReadyError(
                tr("The controller does not confirm low power and the speed that was set."),
                reason=NotReadyReason.HIGH_POWER,
                remedy=tr("Nothing was moved. Check the power mode on the controller."),
                controller=self._identity,
                request=spel.power_low(),
            )

    def restore(self, before: PowerAndSpeed) -> None:
        """Put ``before`` back and prove it; nothing is sent when it is in force already.

        Raises:
            NotReadyError: Another value is read back.
        """
        if self.read() == before:
            return
        for statement in (
            spel.speed(*before.speed_percent),
            spel.speed_s(*before.speed_s_mm_s),
            spel.power_high() if before.power_high else spel.power_low(),
        ):
            # One garbled acknowledgement must not keep the rest from being put back.
            with suppress(UnclearAnswerError):
                self._window.command(statement)
        if self.read() != before:
            raise NotReadyError(
                tr("The previous power mode and speed could not be put back."),
                reason=NotReadyReason.HIGH_POWER,
                remedy=tr("Check Power, Speed and SpeedS before you start the cell."),
                controller=self._identity,
            )

    def power_high(self) -> bool:
        """Read the power mode."""
        return spel.parse_integer(self._window.printed(spel.print_power())) != 0

    def _speed_percent(self, which: int) -> int:
        return spel.parse_integer(self._window.printed(spel.print_speed(which)))

    def _speed_s_mm_s(self, which: int) -> float:
        return spel.parse_number(self._window.printed(spel.print_speed_s(which)))
