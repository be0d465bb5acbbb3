"""Promises about refusals: each check tries a forbidden act, and looks at what it left.

That a driver says when asked that something is forbidden proves nothing about its writes.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Final, cast

from robolink.errors import (
    ConfigError,
    JournalError,
    NotAllowedError,
    OutcomeUnknownError,
    RejectedError,
    RobolinkError,
    StoppedError,
    ToolError,
)
from robolink.model import ANY, ChangeLimits, Controller, Jump, Marker, MarkerKind, ToolOffset
from robolink.testing.subject import Check, Subject, another_offset, refused, require

_OF_NO_TOOL_MM: Final = 2e9
"""Length in mm that no tool has; words of a PLC that are read in the wrong order often yield such
values."""


def what_is_unsettled_blocks(subject: Subject) -> None:
    """A killed process raised no exception: its marker stops the next one."""
    with left_unsettled(subject) as second:
        if second is not None:
            with refused(OutcomeUnknownError, "what is unsettled blocks"):
                second.require_settled("the next command")
            _refuses_acts(second, subject.tool, OutcomeUnknownError, "while that is unsettled")


def nothing_is_sent_that_cannot_be_recorded(subject: Subject) -> None:
    """A process that is killed in a write without a marker leaves nothing that would block."""
    with subject.kept() as controller:
        defined(controller, subject.tool)
        with full_record(controller):
            _refuses_acts(controller, subject.tool, JournalError, "that cannot be recorded")


def a_stop_holds_writes_back(subject: Subject) -> None:
    """Stopped means stopped, until a person says otherwise."""
    with subject.kept() as controller:
        tools, before = controller.tools, defined(controller, subject.tool)
        with subject.releasing_stop(controller):
            with suppress(RobolinkError):  # a machine that cannot be stopped from here reports it
                controller.stop()
            require(controller.latch.closed, "stop() closes the latch, whatever becomes of it")
            _refuses_acts(controller, subject.tool, StoppedError, "after a stop")
            begins = "no procedure begins after a stop"
            with refused(StoppedError, begins), controller.preserved("a check"):
                pass
            with refused(StoppedError, "no change begins after a stop"):
                controller.finish(controller.begin(MarkerKind.CHANGE, "a check", {"tools": {}}))
        tools.write(subject.tool, another_offset(before), expected=before)


def a_stop_in_the_last_instant_holds_a_write_back(subject: Subject) -> None:
    """Between the marker and the request nothing fits but a stop, and the stop comes first."""
    with subject.kept() as controller:
        tools, before = controller.tools, defined(controller, subject.tool)
        for name, act in forbidden_acts(controller, subject.tool).items():
            promise = f"{name} does nothing where a stop came before it left"
            with (
                subject.releasing_stop(controller),
                stopped_when_marked(controller),
                refused(StoppedError, promise),
            ):
                act()
            require(tools.same(tools.read(subject.tool), before), promise)
            require(not controller.outcomes.open_markers(), f"{promise}, so nothing is open")


def a_stop_lets_the_tool_be_put_back(subject: Subject) -> None:
    """The next program must find its tool: at once, or once a machine that holds is reset."""
    with subject.kept() as controller:
        tools, before = controller.tools, controller.tools.selected()
        if before is None:
            return
        defined(controller, subject.tool)
        with subject.releasing_stop(controller):
            with suppress(RobolinkError), controller.preserved("a check"):
                with suppress(RejectedError):  # if only the machine selects tools
                    tools.select(0 if before else subject.tool)
                controller.stop()
            left = controller.outcomes.open_markers()
            named = any(marker.details.get("tool") == before for marker in left)
            # A PLC that holds the stop accepts no selection until it is reset.
            kept = tools.selected() == before or (named and controller.status().paused)
            require(kept, "after a stop the tool of before is selected")
        for marker in left:
            controller.resolver.settle(controller.resolver.examine(marker))
        require(tools.selected() == before, "the tool of before is selected again")
        require(not controller.outcomes.open_markers(), "and nothing is left open")


def values_of_no_tool_are_refused(subject: Subject) -> None:
    """A controller that is told such values goes into error, and nobody knows what it holds."""
    with subject.kept() as controller:
        tools, before = controller.tools, controller.tools.read(subject.tool)
        value = replace(another_offset(before), x_mm=_OF_NO_TOOL_MM)
        with refused((ToolError, ConfigError, RejectedError), "values of no tool are refused"):
            tools.write(subject.tool, value, expected=ANY)
        require(tools.same(tools.read(subject.tool), before), "the old value is still there")
        require(not controller.status().fault, "the controller is not in error over it")
        require(not controller.outcomes.open_markers(), "nothing is left open")


def a_jump_beyond_the_cell_is_refused(subject: Subject) -> None:
    """A sign or a unit that went wrong is refused whoever writes; an engineer may accept it."""
    with subject.kept() as controller:
        tools, guard, tool = controller.tools, controller.change_guard, subject.tool
        stated, before = guard.limits, another_offset(tools.read(tool))
        tools.write(tool, before, expected=ANY)
        far = another_offset(before)
        jump = Jump.between(before, far)
        guard.limits = ChangeLimits(length_mm=jump.length_mm / 2)
        try:
            for expected in (before, ANY):
                with refused(NotAllowedError, "a tip is taken no farther than the cell allows"):
                    tools.write(tool, far, expected=expected)
            require(tools.same(tools.read(tool), before), "the old value is still there")
            require(not controller.outcomes.open_markers(), "nothing is left open")
            with guard.accepting(tool, jump):
                tools.write(tool, far, expected=before)
            require(tools.same(tools.read(tool), far), "what an engineer accepts is written")
            with refused(NotAllowedError, "it is accepted once"):
                tools.write(tool, before, expected=far)
            with controller.latch.putting_back(tool):
                tools.write(tool, before, expected=far)
            require(tools.same(tools.read(tool), before), "the value of before may be put back")
        finally:
            guard.limits = stated


def text_is_no_value(subject: Subject) -> None:
    """What a person typed never becomes a statement of the controller."""
    text = cast(int, f"{subject.tool}; Motor On")
    with subject.kept() as controller:
        tools, before = controller.tools, controller.tools.read_all()
        acts: tuple[Callable[[], object], ...] = (
            lambda: tools.read(text),
            lambda: tools.select(text),
            lambda: tools.clear(text, expected=ANY),
            lambda: tools.write(text, ToolOffset(1.0), expected=ANY),
            lambda: tools.write(subject.tool, ToolOffset(cast(float, text)), expected=ANY),
        )
        for act in acts:
            with refused((ConfigError, ToolError), "text in the place of a number is refused"):
                act()
        require(tools.read_all() == before, "and changes nothing")


def what_is_asked_for_is_compared_as_it_is_sent(subject: Subject) -> None:
    """Else a third of a millimetre would be written, and wear the flash, again and again."""
    with subject.kept() as controller:
        tools, third = controller.tools, ToolOffset(100 / 3, -10 / 3, -200 / 3)
        receipt = tools.write(subject.tool, third, expected=ANY)
        require(tools.same(receipt.requested, receipt.read_back), "what was sent was read back")
        again = tools.write(subject.tool, third, expected=receipt.read_back)
        require(again.skipped, "a value with more digits than are sent is written once")


def defined(controller: Controller, tool: int) -> ToolOffset:
    """Return a tool's value, once it has one.

    Args:
        controller: Where it is.
        tool: Number of a tool that may be written.
    """
    before = controller.tools.read(tool)
    if before is not None:
        return before
    value = another_offset(None)
    controller.tools.write(tool, value, expected=None)
    return value


def forbidden_acts(controller: Controller, tool: int) -> dict[str, Callable[[], object]]:
    """Return what would send a change of a tool, by name, as far as this kind does it.

    Args:
        controller: Who would be told; it is asked now, and not by the acts.
        tool: Number of a tool that is defined and may be written.
    """
    tools, there = controller.tools, controller.tools.read(tool)
    other = 0 if tools.selected() == tool else tool
    acts: dict[str, Callable[[], object]] = {
        "a write": lambda: tools.write(tool, another_offset(there), expected=there),
    }
    with suppress(ToolError, RejectedError):  # if this kind cannot clear a tool
        if tools.preview_clear(tool, then_select=0):
            acts["a clear"] = lambda: tools.clear(tool, expected=there, then_select=0)
    with suppress(ToolError, RejectedError):  # if only the machine selects tools
        if tools.preview_select(other):
            acts["a selection"] = lambda: tools.select(other)
    return acts


def _refuses_acts(controller: Controller, tool: int, kind: type[RobolinkError], when: str) -> None:
    """Try each act, and require that it is refused and has changed nothing."""
    tools = controller.tools
    before, selected = tools.read(tool), tools.selected()
    for name, act in forbidden_acts(controller, tool).items():
        with refused(kind, f"{name} is refused {when}"):
            act()
        require(tools.same(tools.read(tool), before), f"{name} {when} leaves the old value")
        require(tools.selected() == selected, f"{name} {when} selects nothing")


@contextmanager
def left_unsettled(subject: Subject) -> Iterator[Controller | None]:
    """Connect to what a killed process left, for a block; ``None`` if its record is gone too.

    Args:
        subject: What is connected to.
    """
    marker: Marker | None = None
    try:
        with subject.connect() as first:
            marker = first.begin(MarkerKind.CHANGE, "a check", {"tools": {}, "change": "a check"})
        with subject.connect() as second:
            # If it is not open here, the record exists only with the connection.
            yield second if _is_open(second, marker) else None
    finally:
        # Ctrl-C in between must not leave an open marker that blocks what follows.
        with subject.connect() as third:
            if marker is not None and _is_open(third, marker):
                third.finish(marker)
                third.require_settled("the next command")


def _is_open(controller: Controller, marker: Marker) -> bool:
    return marker.operation in {one.operation for one in controller.outcomes.open_markers()}


@contextmanager
def stopped_when_marked(controller: Controller) -> Iterator[None]:
    """Let a stop come in a block as soon as a marker is stored.

    Args:
        controller: Whose markers.
    """
    store = controller.outcomes.begin

    def store_and_stop(marker: Marker) -> None:
        store(marker)
        controller.latch.close()

    record = vars(controller.outcomes)
    record["begin"] = store_and_stop
    try:
        yield
    finally:
        del record["begin"]


@contextmanager
def full_record(controller: Controller) -> Iterator[None]:
    """Let no marker be stored in a block, as on a disk that is full.

    Args:
        controller: Whose markers.
    """

    def refuse(_marker: Marker) -> None:
        raise JournalError("A check lets nothing be recorded.")

    record = vars(controller.outcomes)
    record["begin"] = refuse
    try:
        yield
    finally:
        del record["begin"]


GUARD_CHECKS: Final[tuple[Check, ...]] = (
    what_is_unsettled_blocks,
    nothing_is_sent_that_cannot_be_recorded,
    a_stop_holds_writes_back,
    a_stop_in_the_last_instant_holds_a_write_back,
    a_stop_lets_the_tool_be_put_back,
    values_of_no_tool_are_refused,
    a_jump_beyond_the_cell_is_refused,
    text_is_no_value,
    what_is_asked_for_is_compared_as_it_is_sent,
)
"""Checks that try to write one tool although that is forbidden, and restore it."""
