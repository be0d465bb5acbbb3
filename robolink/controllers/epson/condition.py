"""The state of an EPSON controller beyond its flags, as far as it can be read now.

Alarms: what the controller wants looked after, apart from errors.

Source: docs/reference/epson.md 1.2.
"""

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from robolink.controllers.driver_link import DriverPart
from robolink.controllers.epson.group import EpsonGroup
from robolink.controllers.epson.link import EpsonLink
from robolink.controllers.epson.tools import EpsonToolTable, PublishedTools
from robolink.errors import (
    ConfigError,
    ControllerFaultError,
    RejectedError,
    RemoteProtocolError,
    ToolError,
)
from robolink.messages import tr
from robolink.model import ControllerState
from robolink.protocols import spel
from robolink.protocols.epson_text import Preference

_HIGHEST = 99_999


class EpsonAlarms(DriverPart):
    """The active alarms. GetAlm exists from RC+ 7 on; older firmware refuses it (11)."""

    def __init__(self, link: EpsonLink) -> None:
        super().__init__(link)
        self._session = link.session
        self._window = link.window
        self._lock = link.lock

    def list(self) -> tuple[int, ...]:
        """Read the numbers of the alarms.

        Raises:
            RejectedError: This firmware does not know the request.
        """
        count, *numbers = self._session.exchange("GetAlm").fields
        if spel.parse_integer(count) != len(numbers):
            raise RemoteProtocolError(
                tr(
                    "The controller announced {count} alarms, but {found} arrived.",
                    count=count,
                    found=numbers,
                ),
                remedy=tr("Keep this text and report it with the controller's firmware version."),
                request="GetAlm",
            )
        return tuple(spel.parse_integer(number) for number in numbers)

    def reset(self, number: int) -> None:
        """Reset one alarm at a person's request, and confirm that it is gone.

        Raises:
            NotReadyError: The state forbids it, monitoring only and a running program
                included: the conditions of ResetAlm are not documented.
            RejectedError: No such alarm stands, or the firmware does not know the request.
            ControllerFaultError: The alarm is still there.
        """
        if isinstance(number, bool) or not 0 < number <= _HIGHEST:
            raise ConfigError(
                tr("{number!r} is not an alarm's number.", number=number),
                remedy=tr("'robolink status' shows the alarms that are on."),
            )
        request = f"ResetAlm,{number}"
        with self._lock.held(request, calming=True):
            self._window.require_ready(request)
            self._session.exchange("ResetAlm", str(number))
            if number in self.list():
                raise ControllerFaultError(
                    tr("Alarm {number} is still on after its reset.", number=number),
                    code=number,
                    remedy=tr("Remove the cause; the alarm list in RC+ names it."),
                )


_TOLD: Final = (
    Preference.DRY_RUN,
    Preference.VIRTUAL_IO,
    Preference.RESET_OUTPUTS_OFF,
    Preference.OUTPUTS_OFF_AT_ESTOP,
)
"""Preferences that matter for tool work."""


class ConditionReader:
    """Reads the text of an error, the alarms, the selected tool, motors and power."""

    def __init__(
        self, link: EpsonLink, alarms: EpsonAlarms, tools: EpsonToolTable, group: EpsonGroup
    ) -> None:
        self._preferences = link.preferences
        self._window = link.window
        self._alarms = alarms
        self._tools = tools
        self._group = group

    def read(self, *, published: Callable[[], PublishedTools | None]) -> dict[str, object]:
        """Return plain JSON; ``None`` for what this line, firmware or state does not show.

        While production runs only the flags and the alarms are read (docs/reference/epson.md 1.2,
        1.3).

        Args:
            published: Reads the tools as the companion program published them.
        """
        status = self._window.status()
        found: dict[str, object] = {
            "text": self._window.error_text(status.code) if status.code else "",
            "alarms": None,
            "selected_tool": None,
            "published_selected_tool": None,
            "motors_on": None,
            "power": None,
            "preferences": self._told(),
        }
        with suppress(RejectedError):  # older firmware has no alarms
            found["alarms"] = list(self._alarms.list())
        if status.state is ControllerState.READY:
            # A controller set to monitoring only may not show it in its flags.
            with suppress(RejectedError):
                found["selected_tool"] = self._tools.selected()
                found["motors_on"] = self._group.motors_on()
                found["power"] = "high" if self._group.settings.power_high() else "low"
        if found["selected_tool"] is None:
            # If the table is just being changed, the state must still be shown.
            with suppress(RejectedError, ToolError):
                table = published()
                found["published_selected_tool"] = table.selected if table else None
        return found

    def _told(self) -> dict[str, bool] | None:
        on = self._preferences.read()
        return None if on is None else {p.name.lower(): p in on for p in _TOLD}
