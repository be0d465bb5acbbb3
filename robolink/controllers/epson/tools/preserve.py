"""Puts back what a procedure changed: the tool, the power mode and the speed."""

from collections.abc import Mapping
from dataclasses import dataclass

from robolink.controllers.epson.link.link import EpsonLink
from robolink.controllers.epson.motion.group import EpsonGroup
from robolink.controllers.epson.motion.power_and_speed import PowerAndSpeed
from robolink.controllers.epson.tools.table import EpsonToolTable
from robolink.controllers.preserving import Preserver, not_understood
from robolink.errors import RemoteProtocolError
from robolink.messages import tr
from robolink.model import Marker


@dataclass(frozen=True, slots=True)
class InForce:
    """What a procedure must leave as it found it."""

    tool: int
    settings: PowerAndSpeed

    def to_details(self) -> dict[str, object]:
        """Return plain values for a marker."""
        return {
            "tool": self.tool,
            "now": self.tool,
            "power_high": self.settings.power_high,
            "speed_percent": list(self.settings.speed_percent),
            "speed_s_mm_s": list(self.settings.speed_s_mm_s),
        }

    def shown(self) -> str:
        """Return it in one line, as the controller's own words."""
        power = "High" if self.settings.power_high else "Low"
        speeds = (self.settings.speed_percent, self.settings.speed_s_mm_s)
        speed, speed_s = (", ".join(f"{value:g}" for value in values) for values in speeds)
        return f"Tool {self.tool}, Power {power}, Speed {speed}, SpeedS {speed_s}"

    @classmethod
    def from_marker(cls, marker: Marker) -> "InForce":
        """Return what ``marker`` says is to be put back.

        Raises:
            ConfigError: The marker was written by something else.
        """
        try:
            details = marker.details
            tool, high = details["tool"], details["power_high"]
            speed, speed_s = details["speed_percent"], details["speed_s_mm_s"]
            if not (
                isinstance(tool, int) and isinstance(speed, list) and isinstance(speed_s, list)
            ):
                raise TypeError
            a, b, c = (int(value) for value in speed)
            d, e, f = (float(value) for value in speed_s)
        except (KeyError, TypeError, ValueError) as error:
            raise not_understood(marker) from error
        return cls(tool, PowerAndSpeed(bool(high), (a, b, c), (d, e, f)))


class EpsonPreserver(Preserver):
    """Puts back the selected tool, and power and speed with it."""

    def __init__(self, link: EpsonLink, tools: EpsonToolTable, group: EpsonGroup) -> None:
        super().__init__(link, tools, (group,))
        self._epson = link
        self._table = tools
        self._settings = group.settings

    def _in_force(self, reason: str) -> Mapping[str, object]:
        """Read what is to be put back, twice.

        Every other value here is proved by what was sent; these have nothing to be compared
        with. One bent digit would be put back at the end as the cell's own speed or tool, and
        be proved by reading.

        Raises:
            RemoteProtocolError: The two differ; nothing was changed.
        """
        self._epson.window.require_ready(reason)
        self._epson.preferences.require_real(reason)
        first, second = (InForce(self._tool(), self._settings.read()) for _ in range(2))
        if first != second:
            raise RemoteProtocolError(
                tr(
                    "The controller gave two different answers about its tool, power "
                    "and speed: {first}, then {second}.",
                    first=first.shown(),
                    second=second.shown(),
                ),
                remedy=tr(
                    "Nothing was changed. Check the cable and everything between this "
                    "PC and the controller, and that no other program sets them."
                ),
                controller=self._epson.identity,
                request=reason,
            )
        return first.to_details()

    def _tool(self) -> int:
        tool = self._table.selected()
        assert tool is not None  # noqa: S101 - an EPSON controller always tells
        return tool

    def _restore_more(self, marker: Marker) -> None:
        self._settings.restore(InForce.from_marker(marker).settings)

    def _restored_more(self, marker: Marker) -> bool:
        return self._settings.read() == InForce.from_marker(marker).settings

    def _action(self, marker: Marker, now: int | None) -> str:
        tool = InForce.from_marker(marker).tool
        if now == tool:
            return tr("Set power mode and speed as they were")
        return tr("Select tool {tool} again, with the earlier power mode and speed", tool=tool)
