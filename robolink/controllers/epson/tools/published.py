"""The tool table as the companion program publishes it: robolink_tools.prg.

Execute is not available while production runs, nor to a client that may only monitor; the
project's variables are (docs/reference/epson.md 1.3). So the project itself copies its tools into
Global Preserve variables, and they are read with GetVariable, which changes nothing.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from robolink.controllers.epson.io.variables import EpsonVariables
from robolink.errors import RejectedError, ToolError
from robolink.messages import tr
from robolink.model import ToolOffset
from robolink.protocols.epson_text import ErrorCode, VariableType

LAYOUT: Final = 1
"""Number of the arrangement below; the program writes it into its state."""

_BEGIN: Final = "robolink_begin"
_END: Final = "robolink_end"
_STATE: Final = "robolink_state"
_TABLE: Final = "robolink_tool"
_TOOLS: Final = range(1, 16)
_STATE_COUNT: Final = 19
_TABLE_COUNT: Final = 90
_ATTEMPTS: Final = 3


@dataclass(frozen=True, slots=True)
class PublishedTools:
    """The tools as the project last published them.

    Attributes:
        tools: Every tool by number; an undefined one is ``None``.
        selected: The tool in force then, 0 for the flange.
        robot: The robot whose tools they are.
        publication: A count that grows with each publication of something new.
    """

    tools: Mapping[int, ToolOffset | None]
    selected: int
    robot: int
    publication: int


class PublishedReader:
    """Reads the companion's variables, and a torn table again."""

    def __init__(self, variables: EpsonVariables) -> None:
        self._variables = variables

    def read(self) -> PublishedTools | None:
        """Return the table, ``None`` where the project publishes none.

        Raises:
            ToolError: It was being changed at every attempt, or was arranged by another
                version of the companion.
            RejectedError: The controller refused for another reason.
        """
        try:
            for _ in range(_ATTEMPTS):
                # The program counts up the one before and the other after it changes the
                # table; read the other way about, equal counts enclose a whole table.
                publication = self._whole(_END)
                state = self._wholes()
                table = self._numbers()
                if self._whole(_BEGIN) == publication:
                    return _understood(publication, state, table)
        except RejectedError as error:
            if error.code == ErrorCode.NO_SUCH_VARIABLE:
                return None
            raise
        raise ToolError(
            tr("The published tool table was being changed at each of {n} readings.", n=_ATTEMPTS),
            remedy=tr(
                "Try again. If it stays so, the program was stopped in the middle of "
                "RobolinkPublish; its next call puts that right."
            ),
        )

    def _whole(self, name: str) -> int:
        return int(self._variables.read(name, VariableType.LONG))

    def _wholes(self) -> tuple[int, ...]:
        values = self._variables.read_array(_STATE, (0,), VariableType.LONG, count=_STATE_COUNT)
        return tuple(int(value) for value in values)

    def _numbers(self) -> tuple[float, ...]:
        values = self._variables.read_array(_TABLE, (0,), VariableType.DOUBLE, count=_TABLE_COUNT)
        return tuple(float(value) for value in values)


def _understood(
    publication: int, state: tuple[int, ...], table: tuple[float, ...]
) -> PublishedTools | None:
    layout, robot, selected, _, *defined = state
    if layout == 0:
        return None  # declared, but the program has not run since the project was loaded
    if layout != LAYOUT:
        raise ToolError(
            tr(
                "The project publishes its tools in layout {found}; this robolink reads {own}.",
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
