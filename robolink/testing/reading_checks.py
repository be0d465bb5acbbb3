"""Promises that are checked without changing anything."""

import json
from typing import Final

from robolink.errors import ConfigError, RobolinkError, ToolIndexError
from robolink.model import ControllerStatus, Marker, MarkerKind, ToolOffset, new_operation
from robolink.testing.subject import Check, Subject, refused, require

_OPTIONAL: Final = ("io", "points", "variables", "alarms")


def who_it_is_is_the_same_each_time(subject: Subject) -> None:
    """A record hangs on who the controller is, so that must not change with the connection."""
    with subject.connect() as first:
        address, name = first.identity, first.outcomes.identity
    with subject.connect() as second:
        require("://" in address, "identity is a URL")
        require("@" not in address, "identity carries no user name or password")
        require(second.identity == address, "identity is the same for each connection")
        require(name and second.outcomes.identity == name, "so is who the controller is on record")


def the_status_is_read(subject: Subject) -> None:
    """Each call asks the controller anew."""
    with subject.connect() as controller:
        before = controller.exchanges
        status = controller.status()
        require(isinstance(status, ControllerStatus), "status() returns a ControllerStatus")
        require(controller.exchanges > before, "status() asks, and exchanges counts that")


def what_it_says_of_itself_is_plain(subject: Subject) -> None:
    """condition() goes into JSON documents as it is."""
    with subject.connect() as controller:
        controller.facts()
        try:
            json.dumps(dict(controller.condition()))
        except TypeError as error:
            require(False, f"condition() is plain JSON: {error}")


def capabilities_say_what_is_there(subject: Subject) -> None:
    """Nobody has to try what a kind can do."""
    with subject.connect() as controller:
        able = controller.capabilities
        flags = (able.io, able.points, able.variables, able.alarms)
        parts = (controller.io, controller.points, controller.variables, controller.alarms)
        for name, flag, part in zip(_OPTIONAL, flags, parts, strict=True):
            require(
                flag is (part is not None), f"capabilities.{name} says whether .{name} is there"
            )
        require(controller.groups or not able.motion, "what can be moved has a group")


def tools_are_read_by_number(subject: Subject) -> None:
    """Every tool that is listed can be read, tool 0 is the flange, any other number is refused."""
    with subject.connect() as controller:
        tools = controller.tools
        numbers = list(tools.indices())
        require(subject.tool in numbers, "indices() lists the tool that the checks may change")
        require(0 not in numbers, "indices() leaves out tool 0, which cannot be written")
        require(numbers == sorted(set(numbers)), "indices() is in order, each number once")
        everything = tools.read_all()
        require(list(everything) == numbers, "read_all() reads what indices() lists")
        for number in numbers[:3]:
            alike = tools.same(tools.read(number), everything[number])
            require(alike, "read() and read_all() agree")
        require(tools.read(0) == ToolOffset(), "tool 0 reads as zeros")
        for wrong in (max(numbers) + 1, -1, True):
            with refused(ToolIndexError, f"there is no tool {wrong!r}"):
                tools.read(wrong)


def undefined_is_no_value(subject: Subject) -> None:
    """A tool of zeros is told from one that has no definition."""
    with subject.connect() as controller:
        same = controller.tools.same
        require(same(None, None), "undefined is the same as undefined")
        require(not same(None, ToolOffset()), "undefined is not the same as a tool of zeros")
        require(same(ToolOffset(1.0), ToolOffset(1.0)), "an offset is the same as itself")
        require(not same(ToolOffset(1.0), ToolOffset(1.1)), "a tenth of a millimetre is told")


def a_marker_of_somebody_else_is_refused(subject: Subject) -> None:
    """What the driver did not write it does not pretend to understand."""
    marker = Marker(new_operation(), MarkerKind.SET, "something else", "2026-01-01T00:00:00Z")
    with subject.connect() as controller, refused(ConfigError, "an unknown marker is refused"):
        controller.resolver.examine(marker)


def closing_is_final(subject: Subject) -> None:
    """It may be closed twice, and nothing is asked of it afterwards."""
    controller = subject.connect()
    controller.close()
    controller.close()
    with refused(RobolinkError, "status() after close() is an error of robolink"):
        controller.status()


READING_CHECKS: Final[tuple[Check, ...]] = (
    who_it_is_is_the_same_each_time,
    the_status_is_read,
    what_it_says_of_itself_is_plain,
    capabilities_say_what_is_there,
    tools_are_read_by_number,
    undefined_is_no_value,
    a_marker_of_somebody_else_is_refused,
    closing_is_final,
)
"""Checks that only read."""
