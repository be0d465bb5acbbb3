"""Puts back what a procedure changed: the tool, the power mode and the speed.

A calibration works in Tool 0, and the selection survives power-off (docs/reference/epson.md 3.1):
left there, the next program would drive the flange where the nozzle tip belongs. So a durable
marker names the cell's own tool before anything is changed, and goes only when that tool
has been read back.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from robolink.controllers.epson.link.preferences import Preferences
from robolink.controllers.epson.link.session import EpsonSession
from robolink.controllers.epson.link.window import CommandWindow
from robolink.controllers.epson.motion.group import EpsonGroup
from robolink.controllers.epson.motion.power_and_speed import PowerAndSpeed
from robolink.controllers.epson.tools.table import EpsonToolTable
from robolink.controllers.markers import MarkerStore, ProcedureLock, unrestored_tool
from robolink.errors import ConfigError, RemoteProtocolError, RobolinkError
from robolink.messages import tr
from robolink.model import Marker, MarkerKind
from robolink.ways import Way, way


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
            raise ConfigError(
                tr("The marker of {when} cannot be understood.", when=marker.begun_at),
                remedy=tr(
                    "Select the right tool by hand, then {forget}.", forget=way(Way.FORGET_MARKER)
                ),
            ) from error
        return cls(tool, PowerAndSpeed(bool(high), (a, b, c), (d, e, f)))


class Preserver:
    """Remembers at the start of a procedure, restores at its end."""

    def __init__(
        self,
        session: EpsonSession,
        window: CommandWindow,
        markers: MarkerStore,
        lock: ProcedureLock,
        preferences: Preferences,
        *,
        tools: EpsonToolTable,
        group: EpsonGroup,
    ) -> None:
        self._session = session
        self._window = window
        self._markers = markers
        self._lock = lock
        self._preferences = preferences
        self._tools = tools
        self._group = group

    @contextmanager
    def preserved(self, reason: str) -> Iterator[None]:
        """See :meth:`robolink.model.Controller.preserved`."""
        with self._lock.held(reason), self._markers.ledger.block():
            self._markers.look()
            self._markers.require_settled(reason)
            self._window.require_ready(reason)
            self._preferences.require_real(reason)
            before = self._in_force(reason)
            marker: Marker | None = None
            try:
                with self._session.uninterrupted():
                    marker = self._markers.begin(MarkerKind.SELECTION, reason, before.to_details())
                yield
            except BaseException as error:
                if marker is not None:
                    self._restore_after(error, before, marker)
                raise
            self.restore(before, marker)

    def _in_force(self, reason: str) -> InForce:
        """Read what is to be put back, twice.

        Every other value here is proved by what was sent; these have nothing to be compared
        with. One bent digit would be put back at the end as the cell's own speed or tool, and
        be proved by reading.

        Raises:
            RemoteProtocolError: The two differ; nothing was changed.
        """
        first, second = (
            InForce(self._tools.selected(), self._group.settings.read()) for _ in range(2)
        )
        if first != second:
            raise RemoteProtocolError(
                tr(
                    "What the controller says about its tool, power and speed is not the same "
                    "twice: {first}, then {second}.",
                    first=first.shown(),
                    second=second.shown(),
                ),
                remedy=tr(
                    "Nothing was changed. Check the cable and what stands between this PC and "
                    "the controller, and that no other program sets them."
                ),
                controller=self._session.identity,
                request=reason,
            )
        return first

    def restore(self, before: InForce, marker: Marker) -> None:
        """Put ``before`` back, read it back, and forget ``marker``; Ctrl-C waits for the end."""
        with self._session.uninterrupted(), self._session.latch.restoring():
            self._group.abort_unfinished()
            self._tools.select(before.tool)
            self._group.settings.restore(before.settings)
            self._markers.clear(marker)

    def _restore_after(self, error: BaseException, before: InForce, marker: Marker) -> None:
        """Restore while ``error`` is on its way; if impossible, let it say what is left."""
        try:
            self.restore(before, marker)
        except RobolinkError as second:
            if isinstance(error, RobolinkError):
                error.remedy = f"{error.remedy} {unrestored_tool(second, before.tool)}".strip()
