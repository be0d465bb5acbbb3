"""The tool table of an EPSON controller: TLSet, TLClr, Tool (docs/reference/epson.md 3.1)."""

from collections.abc import Sequence
from contextlib import suppress

from robolink.controllers.epson.link.answers import NOT_EXECUTED
from robolink.controllers.epson.link.preferences import Preferences
from robolink.controllers.epson.link.requests import executes
from robolink.controllers.epson.link.robot import RobotFacts
from robolink.controllers.epson.link.window import CommandWindow
from robolink.controllers.markers import MarkerStore, ProcedureLock
from robolink.controllers.tool_clearing import clear_after_selecting, preview_clearing
from robolink.controllers.tool_writing import ToolWrite, ToolWriter
from robolink.errors import (
    ReadBackError,
    RemoteProtocolError,
    ReservedToolError,
    ToolError,
    ToolIndexError,
    UndefinedToolError,
)
from robolink.messages import tr
from robolink.model import Expected, ToolOffset, ToolReceipt
from robolink.protocols import spel

DECIMALS = 3
"""Places that a printed point shows (docs/reference/epson.md 3.3, from a real capture)."""

TOLERANCE = 0.5 * 10**-DECIMALS
"""Two values that this controller prints alike are equal."""


class EpsonToolTable:
    """Tools 1 to 15 in the controller's flash, and the selected one.

    Every write is compare-and-set and read back. A value that is stored already is not
    written again: TLSet wears the flash (docs/reference/epson.md 3.1).
    """

    def __init__(
        self,
        window: CommandWindow,
        markers: MarkerStore,
        lock: ProcedureLock,
        robot: RobotFacts,
        preferences: Preferences,
    ) -> None:
        self._preferences = preferences
        self._window = window
        self._markers = markers
        self._lock = lock
        self._robot = robot
        self._writer = ToolWriter(
            markers,
            same=self.same,
            uninterrupted=window.uninterrupted,
            not_executed=lambda error: error.code in NOT_EXECUTED,
        )

    def indices(self) -> Sequence[int]:
        """Return 1 to 15; Tool 0 is the flange."""
        return range(1, 16)

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Tell whether this controller prints both alike; undefined equals undefined only."""
        if a is None or b is None:
            return a is b
        return a.matches(b, TOLERANCE)

    def read_all(self) -> dict[int, ToolOffset | None]:
        """Read all fifteen from one TLSet listing; it is empty when none is defined."""
        self._window.require_ready("TLSet")
        listed = spel.parse_tool_listing(self._listing())
        return {tool: listed.get(tool) for tool in self.indices()}

    def read(self, tool: int) -> ToolOffset | None:
        """Read one tool, ``None`` when it is undefined; Tool 0 reads as all zeros."""
        self._check_index(tool, lowest=0)
        self._window.require_ready(f"TLSet {tool}")
        found = self._read(tool)
        self._markers.ledger.saw_tool(tool, found)
        return found

    def write(self, tool: int, offset: ToolOffset, *, expected: Expected) -> ToolReceipt:
        """Write and read back; see :class:`robolink.model.ToolTable`."""
        self.require_writable(tool)
        requested = offset.rounded(DECIMALS)
        with self._lock.held(f"TLSet {tool}"):
            six_axes = self._robot.read(f"TLSet {tool}").six_axes
            self._preferences.require_real(f"TLSet {tool}")
            self._check_axes(requested, six_axes=six_axes)
            statement = spel.set_tool(tool, requested, six_axes=six_axes)
            return self._set(tool, requested, expected, statement)

    def preview_write(self, tool: int, offset: ToolOffset) -> tuple[str, ...]:
        """Return what :meth:`write` would send besides its reads; reads only."""
        self.require_writable(tool)
        self._window.require_ready(f"TLSet {tool}")
        requested = offset.rounded(DECIMALS)
        six_axes = self._robot.read().six_axes
        self._check_axes(requested, six_axes=six_axes)
        if self.same(self._read(tool), requested):
            return ()
        return executes([spel.set_tool(tool, requested, six_axes=six_axes)])

    def preview_clear(self, tool: int, *, then_select: int | None = None) -> tuple[str, ...]:
        """Return what :meth:`clear` would send besides its reads."""
        self.require_writable(tool)
        requests = () if self.read(tool) is None else executes([spel.clear_tool(tool)])
        return preview_clearing(self, tool, requests, then_select)

    def preview_select(self, tool: int) -> tuple[str, ...]:
        """Return what :meth:`select` would send besides its reads."""
        self._require_defined(tool)
        return () if self.selected() == tool else executes([spel.select_tool(tool)])

    def clear(
        self, tool: int, *, expected: Expected, then_select: int | None = None
    ) -> ToolReceipt:
        """Clear and read back; see :class:`robolink.model.ToolTable`."""
        self.require_writable(tool)
        with self._lock.held(f"TLClr {tool}"):
            self._preferences.require_real(f"TLClr {tool}")
            return clear_after_selecting(
                self,
                tool,
                lambda: self._set(tool, None, expected, spel.clear_tool(tool)),
                expected=expected,
                then_select=then_select,
                uninterrupted=self._window.uninterrupted,
            )

    def selected(self) -> int:
        """Read which tool is in force; the selection survives power-off.

        Source: docs/reference/epson.md 3.1.
        """
        self._window.require_ready("Print Tool")
        return self._selected_now()

    def select(self, tool: int) -> None:
        """Put ``tool`` in force and read the selection back."""
        self._check_index(tool, lowest=0)
        statement = spel.select_tool(tool)
        with self._lock.held(statement):
            self._window.require_ready(statement)
            before = self._selected_now()
            if before == tool:
                return
            self._require_defined(tool)
            details = {"select": tool, "before": before}

            def send() -> None:
                self._window.command(statement)
                self._markers.note_selection(tool)

            def read() -> int:
                found = self._selected()
                self._markers.note_selection(found)
                return found

            found = self._writer.carry_out(
                statement,
                details,
                send=send,
                read=read,
                tell=lambda found: tr("Tool {tool} is selected now.", tool=found),
            )
            if found != tool:
                raise ReadBackError(
                    tr(
                        "Tool {tool} was selected, but the controller says that tool {found} is "
                        "in force.",
                        tool=tool,
                        found=found,
                    ),
                    remedy=tr("Do not move the robot; look at the controller's Tool setting."),
                    request=statement,
                )

    def _set(
        self, tool: int, requested: ToolOffset | None, expected: Expected, statement: spel.Statement
    ) -> ToolReceipt:
        write = ToolWrite(
            tool,
            requested,
            statement,
            send=lambda: self._window.command(statement),
            read=lambda: self._before(tool, requested, expected),
            # A tool that was set just now is defined.
            read_back=lambda: self._read(tool) if requested is None else self._printed(tool),
            read_doubted=lambda: self._read(tool),
        )
        return self._writer.change(write, expected)

    def _before(
        self, tool: int, requested: ToolOffset | None, expected: Expected
    ) -> ToolOffset | None:
        """Read what a write replaces.

        The list of all tools takes one question, and whatever is in it is defined. How it looks
        is not documented, so it is believed only where it confirms what was expected to the last
        digit; and not on six axes, where it may leave V and W out.
        """
        with self._window.proving_ready(f"TLSet {tool}"):
            if isinstance(expected, ToolOffset) and not self._robot.read().six_axes:
                listing = self._listing()
                with suppress(RemoteProtocolError):
                    listed = spel.parse_tool_listing(listing).get(tool)
                    if self.same(listed, expected) and not self.same(listed, requested):
                        return listed
            return self._read(tool)

    def _listing(self) -> str:
        return self._window.printed(spel.list_tools(), may_be_nothing=True)

    def _read(self, tool: int) -> ToolOffset | None:
        if tool == 0:
            return ToolOffset()
        # What TLSet(n) gives for an undefined tool is not documented, so that is asked first.
        defined = self._window.printed(spel.print_tool_defined(tool))
        return self._printed(tool) if spel.parse_boolean(defined) else None

    def _printed(self, tool: int) -> ToolOffset:
        point = spel.parse_point(self._window.printed(spel.print_tool(tool)))
        return ToolOffset(*point.coordinates)

    def _require_defined(self, tool: int) -> None:
        # Tool n on an undefined tool leaves the controller in error (docs/reference/epson.md 1.5).
        if self.read(tool) is None:
            raise UndefinedToolError(
                tr("Tool {tool} is not defined, so it was not selected.", tool=tool),
                remedy=tr("Define it first, with a calibration or 'robolink tool set'."),
                request=spel.select_tool(tool),
            )

    def _selected_now(self) -> int:
        """Read the selection outside of a change of it."""
        found = self._selected()
        self._markers.ledger.saw_selected(found)
        return found

    def _selected(self) -> int:
        return spel.parse_integer(self._window.printed(spel.print_selected_tool()))

    def _check_index(self, tool: int, *, lowest: int) -> None:
        if isinstance(tool, bool) or not isinstance(tool, int) or not lowest <= tool <= 15:
            raise ToolIndexError(
                tr("There is no tool {tool}.", tool=tool),
                remedy=tr("EPSON controllers have tools {lowest} to 15.", lowest=lowest),
            )

    def require_writable(self, tool: int) -> None:
        """Refuse a tool number that cannot be written; sends nothing.

        Raises:
            ReservedToolError, ToolIndexError: As :meth:`write` would.
        """
        if tool == 0:
            raise ReservedToolError(
                tr("Tool 0 is the flange itself and is never written."),
                remedy=tr("Choose a tool from 1 to 15."),
            )
        self._check_index(tool, lowest=1)

    def _check_axes(self, offset: ToolOffset, *, six_axes: bool) -> None:
        if not six_axes and (offset.v_deg or offset.w_deg):
            raise ToolError(
                tr("This robot has four axes: a tool's V and W must be 0."),
                remedy=tr("Leave V and W out."),
            )
