"""Clearing a tool never leaves the machine with another tool selected than somebody named.

What a controller selects when the tool in force loses its definition is not documented, and a
program that goes on with Tool 0 drives the flange where a nozzle's tip belongs. So clearing the
tool in force is refused on every kind of controller, unless the caller names the tool to select in
its place; that one is selected, and read back, before anything is cleared.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, suppress

from robolink.errors import ControllerError, RobolinkError, SelectedToolError, ToolError
from robolink.messages import tr
from robolink.model import ANY, Expected, ToolReceipt, ToolTable
from robolink.ways import Way, way


def clear_after_selecting(
    tools: ToolTable,
    tool: int,
    clear: Callable[[], ToolReceipt],
    *,
    expected: Expected,
    then_select: int | None,
    uninterrupted: Callable[[], AbstractContextManager[None]],
    stays_selected: bool = False,
) -> ToolReceipt:
    """Select the tool of the caller's choice where ``tool`` is in force, then clear.

    Nothing is selected for a clear that would be skipped or refused. When the controller refuses
    the clear itself, the tool is selected again.

    Args:
        tools: The table.
        tool: What is to be cleared.
        clear: Clears it, compared with ``expected`` and read back.
        expected: What the caller believes it holds.
        then_select: What is selected in its place, ``None`` if the caller named none.
        uninterrupted: Holds Ctrl-C back between selecting and clearing.
        stays_selected: Whether the machine alone selects, so that naming the tool itself means that
            it stays selected, as a roll-back to what was before has it.

    Raises:
        SelectedToolError: It is in force, and no other tool was named; nothing was sent.
        RobolinkError: As :meth:`robolink.model.ToolTable.clear` and ``select``.
    """
    if tools.selected() != tool:
        return clear()
    stored = tools.read(tool)
    if stored is None or not (expected is ANY or tools.same(stored, expected)):
        return clear()
    if stays_selected and then_select == tool:
        return clear()
    require_replacement(tool, then_select)
    assert then_select is not None  # noqa: S101 - just required
    with uninterrupted():
        tools.select(then_select)
        try:
            return clear()
        except (ControllerError, ToolError):
            with suppress(RobolinkError):
                tools.select(tool)
            raise


def require_replacement(tool: int, then_select: int | None) -> None:
    """Refuse to clear the tool in force where no other one is named to be selected.

    Raises:
        SelectedToolError: None is named, or the same.
    """
    if then_select is None or then_select == tool:
        raise SelectedToolError(
            tr("Tool {tool} is selected, so it was not cleared.", tool=tool),
            remedy=tr(
                "Say which tool the machine is to have in its place: {then_select}, 0 for the "
                "flange; the programs of the machine go on with that one.",
                then_select=way(Way.THEN_SELECT),
            ),
        )


def preview_clearing(
    tools: ToolTable, tool: int, clear: tuple[str, ...], then_select: int | None
) -> tuple[str, ...]:
    """Return what clearing would send besides its reads, a selection before it included.

    Args:
        tools: The table.
        tool: What is to be cleared.
        clear: What is sent to clear it; nothing where it is undefined already.
        then_select: As for :func:`clear_after_selecting`.

    Raises:
        SelectedToolError: It is in force, and no other tool was named.
    """
    if not clear or tools.selected() != tool:
        return clear
    require_replacement(tool, then_select)
    assert then_select is not None  # noqa: S101 - just required
    return (*tools.preview_select(then_select), *clear)
