"""Restores what a procedure changed: the tool, the power mode, the speed, the acceleration.

Settles what an earlier process left open on an EPSON controller.

Judges the open marker of an output, a memory bit or a variable by reading it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from robolink.controllers.epson.answers import PowerAndSpeed, numbers
from robolink.controllers.epson.group import EpsonGroup
from robolink.controllers.epson.link import EpsonLink
from robolink.controllers.epson.tools import EpsonToolTable
from robolink.controllers.epson.values import EpsonIo, EpsonVariables, equal_values
from robolink.controllers.preserving import Preserver, not_understood
from robolink.controllers.resolving import MarkerResolver
from robolink.errors import ConfigError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import Finding, Marker, Value, Verdict
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import local_label


@dataclass(frozen=True, slots=True)
class InForce:
    """What a procedure must leave as it was."""

    tool: int
    settings: PowerAndSpeed

    def to_details(self) -> dict[str, object]:
        """Return plain values for a marker."""
        accel_s = self.settings.accel_s_mm_s2
        return {
            "tool": self.tool,
            "now": self.tool,
            "power_high": self.settings.power_high,
            "speed_percent": list(self.settings.speed_percent),
            "speed_s_mm_s": list(self.settings.speed_s_mm_s),
            **({} if accel_s is None else {"accel_s_mm_s2": list(accel_s)}),
        }

    def shown(self) -> str:
        """Return it in one line, as the controller's own words."""
        settings = self.settings
        power = "High" if settings.power_high else "Low"
        speed, speed_s = numbers(settings.speed_percent), numbers(settings.speed_s_mm_s)
        shown = f"Tool {self.tool}, Power {power}, Speed {speed}, SpeedS {speed_s}"
        if settings.accel_s_mm_s2 is not None:
            shown += f", AccelS {numbers(settings.accel_s_mm_s2)}"
        return shown

    @classmethod
    def from_marker(cls, marker: Marker) -> "InForce":
        """Return what ``marker`` says to restore.

        Raises:
            ConfigError: The marker was written by something else.
        """
        try:
            details = marker.details
            tool, high = details["tool"], details["power_high"]
            speed, speed_s = details["speed_percent"], details["speed_s_mm_s"]
            # Markers of cells that state no acceleration, and those of before, have none.
            accel_s = details.get("accel_s_mm_s2", [])
            if not (
                isinstance(tool, int)
                and isinstance(speed, list)
                and isinstance(speed_s, list)
                and isinstance(accel_s, list)
            ):
                raise TypeError
            if len(accel_s) not in (0, 6):
                raise ValueError
            a, b, c = (int(value) for value in speed)
            d, e, f = (float(value) for value in speed_s)
            accel = tuple(float(value) for value in accel_s) or None
        except (KeyError, TypeError, ValueError) as error:
            raise not_understood(marker) from error
        return cls(tool, PowerAndSpeed(bool(high), (a, b, c), (d, e, f), accel))


class EpsonPreserver(Preserver):
    """Restores the selected tool, and with it power, speed, and the acceleration where stated."""

    def __init__(self, link: EpsonLink, tools: EpsonToolTable, group: EpsonGroup) -> None:
        super().__init__(link, tools, (group,))
        self._epson = link
        self._table = tools
        self._settings = group.settings

    def _in_force(self, reason: str) -> Mapping[str, object]:
        """Read twice what to restore.

        Every other value here is proved by what was sent; these have nothing to be compared
        with. One bent digit would be restored at the end as the cell's own speed or tool, and
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
                    "Nothing was changed. Check the cable, and close other programs that set them."
                ),
                controller=self._epson.identity,
                request=reason,
            )
        return first.to_details()

    def _tool(self) -> int:
        tool = self._table.selected()
        assert tool is not None  # noqa: S101 - an EPSON controller always reports it
        return tool

    def _restore_more(self, marker: Marker) -> None:
        self._settings.restore(InForce.from_marker(marker).settings)

    def _restored_more(self, marker: Marker) -> bool:
        before = InForce.from_marker(marker).settings
        return before.is_shown_by(self._settings.read(before))

    def _action(self, marker: Marker, now: int | None) -> str:
        before = InForce.from_marker(marker)
        if before.settings.accel_s_mm_s2 is None:
            if now == before.tool:
                return tr("Restore power mode and speed")
            return tr(
                "Select tool {tool} again, with the earlier power mode and speed", tool=before.tool
            )
        if now == before.tool:
            return tr("Restore power mode, speed and acceleration")
        return tr(
            "Select tool {tool} again, with the earlier power mode, speed and acceleration",
            tool=before.tool,
        )


class PendingValues:
    """Reads the value that a marker is about; changes nothing."""

    def __init__(self, io: EpsonIo, variables: EpsonVariables) -> None:
        self._io = io
        self._variables = variables

    def examine(self, marker: Marker) -> Finding:
        """Return what happened to the request.

        Raises:
            ConfigError: The marker was written by something else.
        """
        kind = ""
        match marker.details.get("item"):
            case ["output", str(bit)]:
                now: Value = self._io.read_output(int(bit))
            case ["memory", str(bit)]:
                now = self._io.read_memory(int(bit))
            case ["variable", str(name), str(kind)]:
                now = self._variables.read(name, kind)
            case _:
                raise ConfigError(
                    tr(
                        "The record of an unfinished job of {when} cannot be read.",
                        when=local_label(marker.begun_at),
                    ),
                    remedy=tr(
                        "Check the controller, then {forget}.",
                        forget=remedy_word(RemedyWord.FORGET_MARKER),
                    ),
                )
        return _finding(marker, now, kind)


def _finding(marker: Marker, now: Value, kind: str) -> Finding:
    before, requested = marker.details.get("before"), marker.details.get("requested")
    if equal_values(now, requested, kind):
        sentence = tr(
            "{request}: the controller has the new value {now}.", request=marker.request, now=now
        )
        return Finding(marker, Verdict.DONE, sentence)
    if equal_values(now, before, kind):
        sentence = tr(
            "{request}: the controller still has the old value {now}.",
            request=marker.request,
            now=now,
        )
        return Finding(marker, Verdict.NOT_APPLIED, sentence)
    sentence = tr(
        "{request}: the controller has {now}, neither the old value {before} nor the new one.",
        request=marker.request,
        now=now,
        before=before,
    )
    return Finding(marker, Verdict.CONFLICT, sentence)


class EpsonResolver(MarkerResolver):
    """Examines and recovers the open markers that this driver begins."""

    def __init__(
        self,
        link: EpsonLink,
        tools: EpsonToolTable,
        preserver: EpsonPreserver,
        *,
        group: EpsonGroup,
        values: PendingValues,
    ) -> None:
        super().__init__(link, tools, preserver)
        self._group = group
        self._values = values

    def _require_rest(self) -> None:
        self._group.pose()  # refused while the robot moves

    def _examine_more(self, marker: Marker) -> Finding | None:
        if "raw" in marker.details:
            sentence = tr(
                "This PC cannot see whether {statement!r} ran. Look at the controller, then "
                "choose.",
                statement=marker.request,
            )
            return Finding(marker, Verdict.LOOK, sentence)
        return self._values.examine(marker) if "item" in marker.details else None
