"""The tool definitions that a controller stores, and the cost of each change."""

from collections.abc import Mapping
from typing import Final, Literal, TypeAlias

from robolink.model import ToolOffset
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

HIGHEST_TOOL: Final = 15

ClearInForce: TypeAlias = Literal["selects_zero", "keeps", "error"]
"""Effect of TLClr on the selected tool."""


class ToolMemory:
    """Tools 1 to 15 and the selected tool; both survive power-off (docs/reference/spel.md 6.1).

    Attributes:
        flash_writes: TLSet and TLClr executed; each writes the flash (docs/reference/epson.md 3.1).
    """

    def __init__(self) -> None:
        self.flash_writes = 0
        self._offsets: dict[int, ToolOffset] = {}
        self._selected = 0

    @property
    def selected(self) -> int:
        """Number of the selected tool, 0 for the flange."""
        return self._selected

    def get(self, tool: int) -> ToolOffset | None:
        """Return a definition, ``None`` for Tool 0 and for an undefined tool.

        Raises:
            Refusal: There is no such tool number.
        """
        if not 0 <= tool <= HIGHEST_TOOL:
            raise SpelRefusal(RefusalKind.TOOL_NUMBER, f"There is no tool {tool}")
        return self._offsets.get(tool)

    def defined(self) -> dict[int, ToolOffset]:
        """Return every definition, in order."""
        return dict(sorted(self._offsets.items()))

    def set(self, tool: int, offset: ToolOffset) -> None:
        """Define a tool.

        Raises:
            Refusal: Tool 0, or no such tool number.
        """
        self._check_writable(tool)
        self._offsets[tool] = offset
        self.flash_writes += 1

    def clear(self, tool: int, *, in_force: ClearInForce = "error") -> None:
        """Remove a definition.

        Args:
            tool: Number of the tool.
            in_force: What happens when it is the selected tool. That it is an error is documented
                for RC+ 8 (docs/reference/spel.md 10); what older firmware does is not: Tool 0
                may be selected, or the number stays selected, and targets are the flange's.

        Raises:
            Refusal: Tool 0, no such tool number, or the selected tool where that is an error.
        """
        self._check_writable(tool)
        selected = self._selected == tool
        if selected and in_force == "error":
            raise SpelRefusal(RefusalKind.TOOL_IN_FORCE, f"Tool {tool} is selected")
        self._offsets.pop(tool, None)
        if selected and in_force == "selects_zero":
            self._selected = 0
        self.flash_writes += 1

    def select(self, tool: int) -> None:
        """Select a tool.

        Raises:
            Refusal: It is not defined (seen in a client: it needs a reset,
                docs/reference/epson.md 1.5), or there is no such number.
        """
        if self.get(tool) is None and tool != 0:
            raise SpelRefusal(RefusalKind.TOOL_UNDEFINED, f"Tool {tool} is not defined")
        self._selected = tool

    def to_state(self) -> dict[str, object]:
        """Return what survives power-off, ready for JSON."""
        return {
            "selected": self._selected,
            "offsets": {str(n): list(o.components()) for n, o in self.defined().items()},
            "flash_writes": self.flash_writes,
        }

    def restore(self, state: Mapping[str, object]) -> None:
        """Restore what :meth:`to_state` returned.

        Raises:
            TypeError, ValueError: It is something else.
        """
        match state:
            case {"offsets": Mapping() as saved, "selected": int(selected), "flash_writes": int(n)}:
                offsets = {int(tool): ToolOffset(*values) for tool, values in saved.items()}
            case _:
                raise ValueError("not a tool memory's state")
        # A tool that was cleared while it was selected may still be (option of TLClr).
        if not {*offsets, selected} <= set(range(HIGHEST_TOOL + 1)):
            raise ValueError(f"no such tools: {sorted(offsets)}, selected {selected}")
        self._offsets, self._selected, self.flash_writes = offsets, selected, n

    def _check_writable(self, tool: int) -> None:
        self.get(tool)
        if tool == 0:
            raise SpelRefusal(RefusalKind.TOOL_ZERO_FIXED, "Tool 0 is fixed")
