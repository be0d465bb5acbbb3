"""What is true of an EPSON controller beyond its flags, as far as it can be asked now."""

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from robolink.controllers.epson.io.alarms import EpsonAlarms
from robolink.controllers.epson.link.link import EpsonLink
from robolink.controllers.epson.motion.group import EpsonGroup
from robolink.controllers.epson.tools.published import PublishedTools
from robolink.controllers.epson.tools.table import EpsonToolTable
from robolink.errors import RejectedError, ToolError
from robolink.model import ControllerState
from robolink.protocols.epson_text import Preference

_TOLD: Final = (
    Preference.DRY_RUN,
    Preference.VIRTUAL_IO,
    Preference.RESET_OUTPUTS_OFF,
    Preference.OUTPUTS_OFF_AT_ESTOP,
)
"""The preferences that matter for tool work."""


class ConditionReader:
    """Reads the text of an error, the alarms, the tool in force, motors and power."""

    def __init__(
        self, link: EpsonLink, alarms: EpsonAlarms, tools: EpsonToolTable, group: EpsonGroup
    ) -> None:
        self._preferences = link.preferences
        self._window = link.window
        self._alarms = alarms
        self._tools = tools
        self._group = group

    def read(self, *, published: Callable[[], PublishedTools | None]) -> dict[str, object]:
        """Return plain JSON; what this line, firmware or state does not tell is ``None``.

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
            # A controller that serves monitoring only may not show it in its flags.
            with suppress(RejectedError):
                found["selected_tool"] = self._tools.selected()
                found["motors_on"] = self._group.motors_on()
                found["power"] = "high" if self._group.settings.power_high() else "low"
        if found["selected_tool"] is None:
            # A table that is being changed just now must not hide the state.
            with suppress(RejectedError, ToolError):
                table = published()
                found["published_selected_tool"] = table.selected if table else None
        return found

    def _told(self) -> dict[str, bool] | None:
        on = self._preferences.read()
        return None if on is None else {p.name.lower(): p in on for p in _TOLD}
