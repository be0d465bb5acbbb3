"""A tool table; its kind of controller adds how it is read and written.

What a person is refused, what is compared and proved, and in which order, is the same whatever
holds the tools. A kind says which tools there are, how one is read, and how one write leaves.

Clearing a tool never leaves the machine with another tool selected than somebody named. What a
controller selects when the selected tool loses its definition is not documented, and a program
that goes on with Tool 0 drives the flange where a nozzle's tip belongs. So clearing the selected
tool is refused on every kind of controller, unless the caller names the tool to select in its
place; that one is selected, and read back, before anything is cleared.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from typing import ClassVar

from robolink.controllers.driver_link import DriverPart, MarkedCommand
from robolink.controllers.markers import MarkerStore
from robolink.errors import (
    ConfigError,
    ControllerError,
    ReadBackError,
    RejectedError,
    ReservedToolError,
    RobolinkError,
    SelectedToolError,
    ToolError,
    ToolIndexError,
    UndefinedToolError,
)
from robolink.messages import joined, tr
from robolink.model import (
    ANY,
    Expected,
    ToolOffset,
    ToolReceipt,
    describe_offset,
    put_right,
    refuse_operator,
)
from robolink.remedy_words import RemedyWord, remedy_word


class ToolTableCore(DriverPart, ABC):
    """Implements :class:`robolink.model.ToolTable`; each kind of controller adds its own part.

    Attributes:
        machine_selects: Whether the machine alone selects tools, so that to name the tool itself
            in a clear means that it stays selected.

    Args:
        link: The controller.
    """

    machine_selects: ClassVar[bool] = False

    # What each kind must provide.

    @abstractmethod
    def indices(self) -> Sequence[int]:
        """Return the tool numbers that can be written."""

    @abstractmethod
    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Return whether the controller would store both alike; undefined equals undefined only."""

    @abstractmethod
    def _stored(self, tool: int) -> ToolOffset | None:
        """Read a tool other than 0, ``None`` when it is undefined."""

    @abstractmethod
    def _set(self, tool: int, requested: ToolOffset | None, expected: Expected) -> ToolReceipt:
        """Write or clear a tool, by a :class:`~.tool_writing.ToolWrite` of this kind."""

    @abstractmethod
    def _request(self, tool: int, requested: ToolOffset | None) -> str:
        """Return what :meth:`_set` sends besides its reads, in one line."""

    @abstractmethod
    def _selected(self) -> int | None:
        """Read which tool is selected."""

    @abstractmethod
    def _select_request(self, tool: int) -> str:
        """Return what selecting a tool sends, for display."""

    @abstractmethod
    def _send_selection(self, tool: int) -> None:
        """Select a tool; raises unless the controller accepted it."""

    # What a kind may provide.

    def _as_sent(self, request: str) -> str:
        """Return a request as sent on the wire."""
        return request

    def _requests(self, tool: int, requested: ToolOffset | None) -> tuple[str, ...]:
        """Return all that :meth:`_set` sends besides its reads, as sent on the wire."""
        return (self._as_sent(self._request(tool, requested)),)

    def _clear_request(self, tool: int) -> str:
        """Return what clearing is called before it is known whether that is possible."""
        return self._request(tool, None)

    def _storable(self, tool: int, offset: ToolOffset) -> ToolOffset:
        """Return what the controller can hold of an offset."""
        return offset

    def doubts(self, tools: Collection[int]) -> tuple[str, ...]:
        """Return nothing: the machine works with what is stored."""
        return ()

    def _require_possible(self, tool: int, offset: ToolOffset) -> None:
        """Refuse, in a preview, an offset that the machine cannot work with."""

    def _require_readable(self, tool: int) -> None:
        """Refuse a read that the state would not allow."""

    def _require_clearable(self, tool: int) -> None:
        """Refuse a clear that the state would not allow."""

    def _is_in_force(self, tool: int) -> bool:
        """Whether the machine works with the tool that reads as selected."""
        return True

    def _require_selectable(self, request: str) -> None:
        """Refuse a selection that the state would not allow, before anything is read for it."""

    def _prepare_selection(self, tool: int, request: str) -> None:
        """Make sure that a selection may be sent; just before it is."""

    def _prove_selected(self, offset: ToolOffset, request: str) -> None:
        """Confirm more of a selection than the number that is read back."""

    def _choices(self) -> str:
        """Return which tools may be written, as the remedy for tool 0."""
        lowest, *_, highest = self.indices()
        return tr("Choose a tool from {lowest} to {highest}.", lowest=lowest, highest=highest)

    def _known(self, lowest: int) -> str:
        """Return which tools there are, from 0 or 1 on, as the remedy for a missing one."""
        return tr(
            "There are tools {lowest} to {highest}.", lowest=lowest, highest=self.indices()[-1]
        )

    # What is the same for all kinds.

    def require_writable(self, tool: int) -> None:
        """Refuse a tool number that cannot be written; sends nothing.

        Raises:
            ReservedToolError, ToolIndexError: As :meth:`write` would.
        """
        if tool == 0:
            raise ReservedToolError(
                tr("Tool 0 is the flange itself and is never written."), remedy=self._choices()
            )
        self._require_known(tool, lowest=1)

    def read_all(self) -> dict[int, ToolOffset | None]:
        """Read every writable tool; an undefined one is ``None``."""
        return {tool: self.read(tool) for tool in self.indices()}

    def read(self, tool: int) -> ToolOffset | None:
        """Read one tool, ``None`` when it is undefined; tool 0 reads as all zeros."""
        self._require_known(tool)
        self._require_readable(tool)
        if tool == 0:
            return ToolOffset()
        found = self._stored(tool)
        self._driver.markers.ledger.saw_tool(tool, found)
        return found

    def write(
        self, tool: int, offset: ToolOffset, *, expected: Expected, wait_s: float | None = None
    ) -> ToolReceipt:
        """Write and read back; see :class:`robolink.model.ToolTable`."""
        self.require_writable(tool)
        _require_offset(offset)
        _require_expected(expected)
        storable = self._storable(tool, offset)
        self._require_values_of_a_tool(tool, storable)
        with self._driver.lock.patience.within(wait_s):
            return self._set(tool, storable, expected)

    def clear(
        self,
        tool: int,
        *,
        expected: Expected,
        then_select: int | None = None,
        wait_s: float | None = None,
    ) -> ToolReceipt:
        """Clear and read back; see :class:`robolink.model.ToolTable`."""
        self.require_writable(tool)
        _require_expected(expected)
        self._refuse_operator(tool)
        lock = self._driver.lock
        with lock.patience.within(wait_s), lock.held(self._clear_request(tool)):
            self._require_clearable(tool)
            if not self._would_lose_selection(tool, expected, then_select):
                return self._set(tool, None, expected)
            return self._clear_after_selecting(tool, expected, then_select)

    def preview_write(self, tool: int, offset: ToolOffset) -> tuple[str, ...]:
        """Return what :meth:`write` would send besides its reads, as sent on the wire.

        Empty when the value is stored already. Reads only; raises what the write would.
        """
        self.require_writable(tool)
        _require_offset(offset)
        requested = self._storable(tool, offset)
        self._require_values_of_a_tool(tool, requested)
        self._require_readable(tool)
        requests = self._requests(tool, requested)
        if self.same(self._stored(tool), requested):
            return ()
        with self._driver.asked(self._request(tool, requested)):
            self._require_possible(tool, requested)
        return requests

    def preview_clear(self, tool: int, *, then_select: int | None = None) -> tuple[str, ...]:
        """Return what :meth:`clear` would send besides its reads; raises what it would."""
        self.require_writable(tool)
        self._refuse_operator(tool)
        requests = self._requests(tool, None)
        if self.read(tool) is None:
            return ()
        if self.selected() != tool:
            return requests
        return (*self.preview_select(require_replacement(tool, then_select)), *requests)

    def preview_select(self, tool: int) -> tuple[str, ...]:
        """Return what :meth:`select` would send besides its reads."""
        self._require_defined(tool)
        if self.selected() == tool and self._is_in_force(tool):
            return ()
        return (self._as_sent(self._select_request(tool)),)

    def selected(self) -> int | None:
        """Read which tool is selected, 0 for the flange; ``None`` if unknown."""
        found = self._selected()
        self._driver.markers.ledger.saw_selected(found)
        return found

    def select(self, tool: int, *, wait_s: float | None = None) -> None:
        """Select a tool and read the selection back; see the model."""
        self._require_known(tool)
        request, lock = self._select_request(tool), self._driver.lock
        with lock.patience.within(wait_s), lock.held(request):
            self._require_selectable(request)
            before = self._selected()
            self._driver.markers.ledger.saw_selected(before)
            if before == tool and self._is_in_force(tool):
                return
            if before is None:  # the old selection could not be restored, nor the new one confirmed
                raise RejectedError(
                    tr(
                        "{controller} does not report which tool is selected.",
                        controller=self._driver.identity,
                    ),
                    remedy=tr("Select tool {tool} at the machine.", tool=tool),
                )
            offset = self._require_defined(tool)
            self._require_values_of_a_tool(tool, offset)
            self._prepare_selection(tool, request)
            selection = _Selection(
                request,
                tool,
                before,
                markers=self._driver.markers,
                transmit=self._send_selection,
                look=self._selected,
            )
            found = self._driver.carry_out(selection)
            if found != tool:
                raise ReadBackError(
                    tr(
                        "robolink selected tool {tool}, but the controller has tool "
                        "{found} selected.",
                        tool=tool,
                        found=found,
                    ),
                    remedy=tr("Do not move the robot; check the controller's Tool setting."),
                )
            self._prove_selected(offset, request)
            self._driver.decided(f"selected: tool {tool}, after tool {before}", request)

    def _refuse_operator(self, tool: int) -> None:
        """Refuse an operator's clear before another tool is selected for it."""
        if not self._driver.latch.restores:
            refuse_operator(self._driver.markers.outcomes, tr("clear tool {tool}", tool=tool))

    def _would_lose_selection(self, tool: int, expected: Expected, then_select: int | None) -> bool:
        """Whether a clear, unless it is skipped or refused, removes the selected tool."""
        if self.selected() != tool:
            return False
        stored = self.read(tool)
        if stored is None or not (expected is ANY or self.same(stored, expected)):
            return False
        return not (self.machine_selects and then_select == tool)

    def _clear_after_selecting(
        self, tool: int, expected: Expected, then_select: int | None
    ) -> ToolReceipt:
        """Select the caller's replacement, then clear; after a refusal select the old one again."""
        replacement = require_replacement(tool, then_select)
        with self._driver.uninterrupted():
            self.select(replacement)
            try:
                return self._set(tool, None, expected)
            except (ControllerError, ToolError):
                with suppress(RobolinkError):
                    self.select(tool)
                raise

    def _require_defined(self, tool: int) -> ToolOffset:
        # Selecting an undefined tool puts an EPSON controller into error (docs/reference/epson.md
        # 1.5).
        offset = self.read(tool)
        if offset is None:
            raise UndefinedToolError(
                tr("Tool {tool} is not defined, so it was not selected.", tool=tool),
                remedy=tr("Define it first, with a calibration or 'robolink tool set'."),
                request=self._select_request(tool),
            )
        return offset

    def _require_values_of_a_tool(self, tool: int, offset: ToolOffset) -> None:
        """Refuse values of no tool, unless they are restored.

        They may be read and replaced, never worked with or written: an EPSON controller goes into
        error over such a statement, which leaves its outcome in doubt.
        """
        if offset.of_no_tool and not self._driver.latch.restores:
            raise ToolError(
                tr(
                    "Tool {tool} was neither written nor selected: these are {values}.",
                    tool=tool,
                    values=describe_offset(offset),
                ),
                remedy=joined(" ", filter(None, (tr("Nothing was sent."), put_right(offset)))),
            )

    def _require_known(self, tool: int, *, lowest: int = 0) -> None:
        if not isinstance(tool, int) or isinstance(tool, bool):
            raise ToolIndexError(
                tr(
                    "A tool is named by its number, an int, not by {given!r} ({kind}).",
                    given=tool,
                    kind=type(tool).__name__,
                ),
                remedy=self._known(lowest),
            )
        if not (tool in self.indices() or tool == lowest == 0):
            raise ToolIndexError(
                tr("There is no tool {tool}.", tool=tool), remedy=self._known(lowest)
            )


def _require_offset(offset: object) -> None:
    if not isinstance(offset, ToolOffset):
        raise ConfigError(
            tr("An offset is a ToolOffset, not {given}.", given=type(offset).__name__),
            remedy=tr("Nothing was sent. Write ToolOffset(x, y, z, u, v, w), in mm and degrees."),
        )


def _require_expected(expected: object) -> None:
    if expected is not None and expected is not ANY and not isinstance(expected, ToolOffset):
        raise ConfigError(
            tr("The expected value is a ToolOffset, None or ANY, not {given}.", given=expected),
            remedy=tr("Nothing was sent. Give what read() returned before."),
        )


class _Selection(MarkedCommand[int | None]):
    """The selection of one tool."""

    def __init__(
        self,
        request: str,
        tool: int,
        before: int | None,
        *,
        markers: MarkerStore,
        transmit: Callable[[int], None],
        look: Callable[[], int | None],
    ) -> None:
        super().__init__(request)
        self._tool = tool
        self._before = before
        self._markers = markers
        self._transmit = transmit
        self._look = look

    @property
    def details(self) -> Mapping[str, object]:
        return {"select": self._tool, "before": self._before}

    def send(self) -> None:
        self._transmit(self._tool)
        self._markers.note_selection(self._tool)

    def read(self) -> int | None:
        found = self._look()
        if found is not None:
            self._markers.note_selection(found)
        return found

    def told_by(self, found: int | None) -> str:
        return tr("Tool {tool} is selected now.", tool=found)


def require_replacement(tool: int, then_select: int | None) -> int:
    """Return the tool to select in the place of one that is cleared.

    Raises:
        SelectedToolError: None is named, or the same.
    """
    if then_select is None or then_select == tool:
        raise SelectedToolError(
            tr("Tool {tool} is selected, so it was not cleared.", tool=tool),
            remedy=tr(
                "Name the tool to select instead: {then_select}, 0 for the flange. The "
                "machine's programs then use that tool.",
                then_select=remedy_word(RemedyWord.THEN_SELECT),
            ),
        )
    return then_select
