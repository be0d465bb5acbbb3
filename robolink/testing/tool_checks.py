"""Promises about writing: compared, sent once, read back, held back by a stop."""

import threading
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Final

from robolink.errors import (
    BusyError,
    RejectedError,
    ReservedToolError,
    RobolinkError,
    SelectedToolError,
    ToolChangedError,
    ToolError,
    UndefinedToolError,
)
from robolink.model import ANY, Controller, Jump, ToolOffset
from robolink.testing.guard_checks import GUARD_CHECKS
from robolink.testing.subject import Check, Subject, another_offset, refused, require

_COMPONENTS: Final = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")
_WHOLE: Final = dict(zip(_COMPONENTS, (10.125, -20.375, 30.625, 15.5, -2.25, 1.75), strict=True))
"""A value that changes if any component is lost, rounded to tenths or negated."""

_TOLD_APART: Final = 0.1
"""Difference between distinct values, in mm or degrees; a tip would be visibly displaced."""

_TIP_SLACK_MM: Final = 0.1

_AT_ONCE_S: Final = 5.0
"""Time in s that is longer than any refusal takes, even on a slow line."""


def a_write_is_read_back(subject: Subject) -> None:
    """The receipt holds what was there, what was asked for, and what is there now."""
    with subject.kept() as controller:
        tools, before = controller.tools, controller.tools.read(subject.tool)
        wanted = another_offset(before)
        receipt = tools.write(subject.tool, wanted, expected=before)
        require(not receipt.skipped, "a new value is written")
        require(tools.same(receipt.before, before), "the receipt holds the old value")
        require(tools.same(receipt.read_back, wanted), "the receipt holds what was read back")
        require(tools.same(tools.read(subject.tool), wanted), "the new value is there")
        require(not controller.outcomes.open_markers(), "nothing is left open")


def every_component_is_kept(subject: Subject) -> None:
    """A length that is rounded, or an angle that is lost, puts the tip somewhere else."""
    with subject.kept() as controller:
        tools = controller.tools
        wanted, held = _written_whole(controller, subject.tool)
        require(tools.same(tools.read(subject.tool), wanted), "all that was written is there")
        for name in held:
            other = replace(wanted, **{name: getattr(wanted, name) + _TOLD_APART})
            require(not tools.same(wanted, other), f"values {_TOLD_APART} apart in {name} differ")


def a_write_lasts(subject: Subject) -> None:
    """The next connection, which may be tomorrow's, finds what this one wrote."""
    with subject.connect() as controller:
        before, selected = controller.tools.read(subject.tool), controller.tools.selected()
    wanted = another_offset(before)
    try:
        with subject.connect() as controller:
            controller.tools.write(subject.tool, wanted, expected=before)
    finally:
        # Whatever happened in between, including Ctrl-C: only this restores the old value.
        with subject.connect() as controller:
            found = controller.tools.read(subject.tool)
            same = controller.tools.same(found, wanted)
            subject.put_back(controller, before, selected)
    require(same, "a new connection finds the new value")


def the_other_tools_are_left_alone(subject: Subject) -> None:
    """They hold the nozzles of other programs."""
    with subject.kept() as controller:
        tools = controller.tools
        before, selected = tools.read_all(), tools.selected()
        value = another_offset(before.get(subject.tool))
        tools.write(subject.tool, value, expected=ANY)
        _same_but_one(controller, before, subject.tool, "a write")
        require(tools.selected() == selected, "a write selects no tool")
        with suppress(ToolError, RejectedError):  # if this kind cannot clear a tool
            tools.clear(subject.tool, expected=value)
        _same_but_one(controller, before, subject.tool, "a clear")


def the_tip_is_that_of_the_selected_tool(subject: Subject) -> None:
    """A tool that is selected in name only is a crash: the tip is told as far off as it is."""
    with subject.kept() as controller:
        tools = controller.tools
        if not controller.capabilities.motion or tools.selected() is None:
            return
        value = another_offset(tools.read(subject.tool))
        tools.write(subject.tool, value, expected=ANY)
        places = []
        try:
            for tool in (0, subject.tool):
                tools.select(tool)
                places.append(controller.groups[0].pose())
        except RejectedError:
            return  # only the machine selects tools, and has reported it
        flange, tip = (ToolOffset(*pose.coordinates()) for pose in places)
        off_mm = Jump.between(flange, tip).length_mm
        length_mm = Jump.between(ToolOffset(), value).length_mm
        told = f"a tip that is {length_mm:.3f} mm from the flange is told {off_mm:.3f} mm from it"
        require(abs(off_mm - length_mm) < _TIP_SLACK_MM, told)


def what_is_there_already_is_not_written_again(subject: Subject) -> None:
    """A write wears the memory of a controller."""
    with subject.kept() as controller:
        value = another_offset(controller.tools.read(subject.tool))
        controller.tools.write(subject.tool, value, expected=ANY)
        again = controller.tools.write(subject.tool, value, expected=another_offset(value))
        require(again.skipped, "an equal value is skipped, whatever was expected")
        previewed = controller.tools.preview_write(subject.tool, value)
        require(previewed == (), "and nothing would be sent for it")


def an_unexpected_value_is_left_alone(subject: Subject) -> None:
    """Somebody else changed it meanwhile: he must not be overwritten."""
    with subject.kept() as controller:
        tools = controller.tools
        there = another_offset(tools.read(subject.tool))
        tools.write(subject.tool, there, expected=ANY)
        believed, wanted = another_offset(there), another_offset(another_offset(there))
        with refused(ToolChangedError, "another value than expected is not overwritten"):
            tools.write(subject.tool, wanted, expected=believed)
        require(tools.same(tools.read(subject.tool), there), "it is still there")


def the_flange_is_never_written(subject: Subject) -> None:
    """Tool 0 is no tool."""
    with subject.connect() as controller:
        with refused(ReservedToolError, "tool 0 is not written"):
            controller.tools.write(0, ToolOffset(1.0), expected=ANY)
        with refused(ReservedToolError, "tool 0 is not cleared"):
            controller.tools.clear(0, expected=ANY)


def a_preview_changes_nothing(subject: Subject) -> None:
    """It says what would be sent, and sends none of it."""
    with subject.kept() as controller:
        before = controller.tools.read(subject.tool)
        requests = controller.tools.preview_write(subject.tool, another_offset(before))
        require(requests and all(requests), "a preview says what would be sent")
        unchanged = controller.tools.same(controller.tools.read(subject.tool), before)
        require(unchanged, "a preview changes nothing")


def a_cleared_tool_is_undefined(subject: Subject) -> None:
    """Where a kind cannot forget a tool, it says so and changes nothing."""
    with subject.kept() as controller:
        tools = controller.tools
        value = another_offset(tools.read(subject.tool))
        tools.write(subject.tool, value, expected=ANY)
        try:
            tools.clear(subject.tool, expected=value, then_select=0)
        except (ToolError, RejectedError):
            require(tools.same(tools.read(subject.tool), value), "a refused clear changes nothing")
            return
        require(tools.read(subject.tool) is None, "a cleared tool reads as undefined")
        receipt = tools.write(subject.tool, value, expected=None)
        require(receipt.before is None, "undefined is a legal expectation")


def a_selection_is_read_back(subject: Subject) -> None:
    """A selected tool keeps its definition, and only a defined one comes into force."""
    with subject.kept() as controller:
        tools = controller.tools
        value = another_offset(tools.read(subject.tool))
        tools.write(subject.tool, value, expected=ANY)
        try:
            tools.select(subject.tool)
            require(tools.selected() == subject.tool, "the selection is read back")
            with refused(SelectedToolError, "the tool in force is not cleared"):
                tools.clear(subject.tool, expected=value)
            tools.select(0)
        except RejectedError:
            return  # only the machine selects tools, and has reported it
        with suppress(ToolError):
            tools.clear(subject.tool, expected=value)
        if tools.read(subject.tool) is None:
            with refused(UndefinedToolError, "an undefined tool is not selected"):
                tools.select(subject.tool)


def what_was_selected_is_put_back(subject: Subject) -> None:
    """Whatever ends a procedure: the next program must find the tool that it was taught with."""
    with subject.kept() as controller:
        tools, before = controller.tools, controller.tools.selected()
        if before is None:
            return
        tools.write(subject.tool, another_offset(tools.read(subject.tool)), expected=ANY)
        with suppress(_OursError), controller.preserved("a check"):
            with suppress(RejectedError):  # if only the machine selects tools
                tools.select(0 if before else subject.tool)
            raise _OursError
        require(tools.selected() == before, "the tool of before is selected again")
        require(not controller.outcomes.open_markers(), "and nothing is left open")


def one_procedure_at_a_time(subject: Subject) -> None:
    """A second thread is told at once that it has to wait."""
    with subject.kept() as controller:
        ends: list[BaseException | None] = []
        before = controller.tools.read(subject.tool)
        arguments = (controller, subject.tool, before, ends)
        # A thread that waits for the first to end would wait for ever, and block the process.
        other = threading.Thread(target=_write, args=arguments, daemon=True)
        with controller.preserved("a check"):
            other.start()
            other.join(_AT_ONCE_S)
            told = list(ends)
        other.join(_AT_ONCE_S)  # if it waited for the end, it has the result now
        require(told, "a second procedure is told at once, and does not wait")
        require(isinstance(told[0], BusyError), "a second procedure is refused with BusyError")


def _written_whole(controller: Controller, tool: int) -> tuple[ToolOffset, tuple[str, ...]]:
    """Write a value with as many components as this kind has; return it, and their names.

    Raises:
        RobolinkError: It takes none, or a write that it took did not end as it should.
    """
    tools, before = controller.tools, controller.tools.read(tool)
    for held in (_COMPONENTS, _COMPONENTS[:4], _COMPONENTS[:3]):
        wanted = ToolOffset(**{name: _WHOLE[name] for name in held})
        try:
            tools.write(tool, wanted, expected=before)
        except RobolinkError:
            # A kind without these angles reports it, and has written nothing.
            if held == _COMPONENTS[:3] or not tools.same(tools.read(tool), before):
                raise
        else:
            return wanted, held
    raise AssertionError(held)


def _same_but_one(
    controller: Controller, before: Mapping[int, ToolOffset | None], tool: int, act: str
) -> None:
    now = controller.tools.read_all()
    for other, value in before.items():
        kept = other == tool or controller.tools.same(now.get(other), value)
        require(kept, f"{act} of tool {tool} leaves tool {other} as it was")


def _write(
    controller: Controller,
    tool: int,
    before: ToolOffset | None,
    ends: list[BaseException | None],
) -> None:
    try:
        controller.tools.write(tool, another_offset(before), expected=before)
    except Exception as error:
        ends.append(error)  # of any type: it is checked where the result is used
    else:
        ends.append(None)


class _OursError(Exception):
    """Ends a procedure early."""


WRITING_CHECKS: Final[tuple[Check, ...]] = (
    a_write_is_read_back,
    every_component_is_kept,
    a_write_lasts,
    the_other_tools_are_left_alone,
    the_tip_is_that_of_the_selected_tool,
    what_is_there_already_is_not_written_again,
    an_unexpected_value_is_left_alone,
    the_flange_is_never_written,
    a_preview_changes_nothing,
    a_cleared_tool_is_undefined,
    a_selection_is_read_back,
    what_was_selected_is_put_back,
    one_procedure_at_a_time,
    *GUARD_CHECKS,
)
"""Checks that write one tool, and restore it."""
