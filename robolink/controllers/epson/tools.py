"""The tool table of an EPSON controller: TLSet, TLClr, Tool (docs/reference/epson.md 3.1).

The tool table as the companion program publishes it: robolink_tools.prg.

Execute is not available while production runs, nor to a client that may only monitor; the
project's variables are (docs/reference/epson.md 1.3). So the project itself copies its tools into
Global Preserve variables, and they are read with GetVariable, which changes nothing.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Final

from robolink.controllers.epson.link import EpsonLink
from robolink.controllers.epson.session import as_sent
from robolink.controllers.epson.values import EpsonVariables
from robolink.controllers.epson.window import CommandWindow
from robolink.controllers.tool_table import ToolTableCore
from robolink.controllers.tool_writing import Same, ToolWrite
from robolink.errors import RejectedError, RemoteProtocolError, ToolError
from robolink.messages import tr
from robolink.model import Expected, ToolOffset, ToolReceipt, require_offset
from robolink.protocols import spel
from robolink.protocols.epson_text import ErrorCode, Request, VariableType

DECIMALS: Final = 3
"""Number of decimals of a printed point (docs/reference/epson.md 3.3, from a real capture)."""

TOLERANCE: Final = 0.5 * 10**-DECIMALS
"""Largest difference between equal values: this controller prints them alike."""

_TOOLS: Final = range(1, 16)


class EpsonToolTable(ToolTableCore):
    """Tools 1 to 15 in the controller's flash, and the selected one.

    Every write is compare-and-set and read back. A value that is stored already is not
    written again: TLSet wears the flash (docs/reference/epson.md 3.1).
    """

    def __init__(self, link: EpsonLink) -> None:
        super().__init__(link)
        self._link = link
        self._window = link.window

    def indices(self) -> Sequence[int]:
        """Return 1 to 15; Tool 0 is the flange."""
        return _TOOLS

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Return whether this controller prints both alike; undefined equals undefined only."""
        if a is None or b is None:
            return a is b
        require_offset("a", a)
        return a.matches(b, TOLERANCE)

    def read_all(self) -> dict[int, ToolOffset | None]:
        """Read all fifteen from one TLSet listing; it is empty when none is defined."""
        self._window.require_ready("TLSet")
        listed = spel.parse_tool_listing(
            self._window.printed(spel.list_tools(), may_be_nothing=True)
        )
        return {tool: listed.get(tool) for tool in self.indices()}

    def selected(self) -> int | None:
        """Read which tool is selected; the selection survives power-off.

        Source: docs/reference/epson.md 3.1.
        """
        with self._window.proving_ready("Print Tool"):
            return super().selected()

    def _set(self, tool: int, requested: ToolOffset | None, expected: Expected) -> ToolReceipt:
        name = f"TLClr {tool}" if requested is None else f"TLSet {tool}"
        with self._link.lock.held(name):
            if requested is not None:
                self._link.robot.read(name)
                self._link.preferences.require_real(name)
            statement = self._statement(tool, requested)
            return _FlashWrite(self._link, tool, requested, statement, same=self.same).change(
                expected
            )

    def _statement(self, tool: int, requested: ToolOffset | None) -> spel.Statement:
        if requested is None:
            return spel.clear_tool(tool)
        six_axes = self._link.robot.read().six_axes
        if not six_axes and (requested.v_deg or requested.w_deg):
            raise ToolError(
                tr("This robot has four axes: a tool's V and W must be 0."),
                remedy=tr("Leave V and W out."),
            )
        return spel.set_tool(tool, requested, six_axes=six_axes)

    def _request(self, tool: int, requested: ToolOffset | None) -> str:
        return self._statement(tool, requested)

    def _as_sent(self, request: str) -> str:
        return as_sent(Request("Execute", (request,)))

    def _storable(self, tool: int, offset: ToolOffset) -> ToolOffset:  # noqa: ARG002 - alike for all
        return offset.rounded(DECIMALS)

    def _require_readable(self, tool: int) -> None:
        self._window.require_ready(f"TLSet {tool}")

    def _require_clearable(self, tool: int) -> None:
        self._link.preferences.require_real(f"TLClr {tool}")

    def _require_selectable(self, request: str) -> None:
        self._window.require_ready(request)

    def _stored(self, tool: int) -> ToolOffset | None:
        return _stored_tool(self._window, tool)

    def _select_request(self, tool: int) -> str:
        return spel.select_tool(tool)

    def _send_selection(self, tool: int) -> None:
        self._window.command(spel.select_tool(tool))

    def _selected(self) -> int:
        (tool,) = self._window.printed_numbers(spel.print_selected_tool())
        return spel.parse_integer(tool)

    def _known(self, lowest: int) -> str:
        return tr("Choose a tool from {lowest} to 15.", lowest=lowest)


class _FlashWrite(ToolWrite):
    """TLSet or TLClr of one tool."""

    def __init__(
        self,
        link: EpsonLink,
        tool: int,
        requested: ToolOffset | None,
        statement: spel.Statement,
        *,
        same: Same,
    ) -> None:
        super().__init__(link, tool, requested, statement, same=same)
        self._window, self._robot = link.window, link.robot
        self._statement = statement

    def read_before(self, expected: Expected) -> ToolOffset | None:
        """Read what a write replaces.

        The list of all tools takes one question, and whatever is in it is defined. How it looks
        is not documented, so it is believed only where it confirms what was expected to the last
        digit; and not on six axes, where it may leave V and W out.
        """
        with self._window.proving_ready(f"TLSet {self.tool}"):
            if isinstance(expected, ToolOffset) and not self._robot.read().six_axes:
                listing = self._window.printed(spel.list_tools(), may_be_nothing=True)
                with suppress(RemoteProtocolError):
                    listed = spel.parse_tool_listing(listing).get(self.tool)
                    if self._same(listed, expected) and not self._same(listed, self.requested):
                        return listed
            return _stored_tool(self._window, self.tool)

    def send(self) -> None:
        self._window.command(self._statement)

    def read_back(self) -> ToolOffset | None:
        # A tool that was just set is defined.
        return self.read_doubted() if self.requested is None else _printed(self._window, self.tool)

    def read_doubted(self) -> ToolOffset | None:
        return _stored_tool(self._window, self.tool)


def _stored_tool(window: CommandWindow, tool: int) -> ToolOffset | None:
    # The answer of TLSet(n) for an undefined tool is not documented, so ask first if it is defined.
    defined = window.printed(spel.print_tool_defined(tool))
    return _printed(window, tool) if spel.parse_boolean(defined) else None


def _printed(window: CommandWindow, tool: int) -> ToolOffset:
    """Read a tool that is known to be defined."""
    return ToolOffset(*spel.parse_point(window.printed(spel.print_tool(tool))).coordinates)


LAYOUT: Final = 1
"""Number of the layout below; the program writes it into its state."""

_BEGIN: Final = "robolink_begin"
_END: Final = "robolink_end"
_STATE: Final = "robolink_state"
_TABLE: Final = "robolink_tool"
_STATE_COUNT: Final = 19
_TABLE_COUNT: Final = 90
_ATTEMPTS: Final = 3


@dataclass(frozen=True, slots=True)
class PublishedTools:
    """The tools as the project last published them.

    Attributes:
        tools: Every tool by number; an undefined one is ``None``.
        selected: The selected tool then, 0 for the flange.
        robot: The robot whose tools they are.
        publication: A count that grows with each publication of something new.
    """

    tools: Mapping[int, ToolOffset | None] = field(hash=False)
    selected: int
    robot: int
    publication: int


def read_published(variables: EpsonVariables) -> PublishedTools | None:
    """Read the companion's variables; a torn table is read again.

    Returns:
        The table, ``None`` where the project publishes none.

    Raises:
        ToolError: It was being changed at every attempt, or was arranged by another
            version of the companion.
        RejectedError: The controller refused for another reason.
    """

    def whole(name: str) -> int:
        return int(variables.read(name, VariableType.LONG))

    try:
        for _ in range(_ATTEMPTS):
            # The program increments one counter before and the other after it changes the table.
            # Read in the opposite order, equal counters prove that the table is complete.
            publication = whole(_END)
            state = variables.read_array(_STATE, (0,), VariableType.LONG, count=_STATE_COUNT)
            table = variables.read_array(_TABLE, (0,), VariableType.DOUBLE, count=_TABLE_COUNT)
            if whole(_BEGIN) == publication:
                return _understood(publication, tuple(map(int, state)), tuple(map(float, table)))
    except RejectedError as error:
        if error.code == ErrorCode.NO_SUCH_VARIABLE:
            return None
        raise
    raise ToolError(
        tr("The published tool table changed during each of {n} readings.", n=_ATTEMPTS),
        remedy=tr(
            "Try again. If this persists, the program was stopped in the middle of "
            "RobolinkPublish; its next call corrects that."
        ),
    )


def _understood(
    publication: int, state: tuple[int, ...], table: tuple[float, ...]
) -> PublishedTools | None:
    layout, robot, selected, _, *defined = state
    if layout == 0:
        return None  # declared, but the program has not run since the project was loaded
    if layout != LAYOUT:
        raise ToolError(
            tr(
                "The project publishes its tools in layout {found}, but this robolink "
                "reads layout {own}.",
                found=layout,
                own=LAYOUT,
            ),
            remedy=tr("Export the companion again with 'robolink expert spel export' and rebuild."),
        )
    tools: dict[int, ToolOffset | None] = {}
    for tool, there in zip(_TOOLS, defined, strict=True):
        start = (tool - 1) * 6
        tools[tool] = ToolOffset(*table[start : start + 6]) if there else None
    return PublishedTools(tools, selected, robot, publication)
