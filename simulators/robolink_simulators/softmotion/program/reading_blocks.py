"""The function blocks of SoftMotion that read, on the simulated axis group.

Source: docs/reference/softmotion.md 2.1, 2.3.
"""

from collections.abc import Callable, Mapping
from typing import Final

from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.group.condition import ReadToolMode, SmcGroupState
from robolink_simulators.softmotion.kinematics.coordinates import CoordRef, CoordSystem
from robolink_simulators.softmotion.mailbox.words.units import UserUnits
from robolink_simulators.softmotion.program.error_numbers import ErrorNumbers
from robolink_simulators.softmotion.program.foreign_types import (
    AXIS_GROUP,
    CONTINUE_DATA,
    COORD_REF,
    COORD_SYSTEM,
    ERROR_ID,
    POSITION,
    READ_MODE,
)
from robolink_simulators.softmotion.program.motion_blocks import Pins, members_named
from robolink_simulators.softmotion.smc_errors import BlockRefused, SmcError
from robolink_simulators.structured_text.data_types import BOOL, BlockType, Frame

_ENABLE: Final[Pins] = (
    ("axisgroup", AXIS_GROUP, "var_in_out"),
    ("enable", BOOL, "var_input"),
    ("valid", BOOL, "var_output"),
)
_STATES: Final[Mapping[str, SmcGroupState]] = {
    "groupmoving": SmcGroupState.MOVING,
    "grouphoming": SmcGroupState.HOMING,
    "grouperrorstop": SmcGroupState.ERROR_STOP,
    "groupstandby": SmcGroupState.STANDBY,
    "groupstopping": SmcGroupState.STOPPING,
    "groupdisabled": SmcGroupState.DISABLED,
}


def reading_blocks(units: UserUnits, numbers: ErrorNumbers) -> Mapping[str, BlockType]:
    """Return the blocks by name, in capital letters.

    Args:
        units: Between user units and those of the simulated group.
        numbers: Of complaints.
    """
    return {
        "MC_GROUPREADSTATUS": _status(),
        "MC_GROUPREADERROR": _error(numbers),
        "MC_GROUPREADACTUALPOSITION": _position(units),
        "SMC_GROUPREADTOOL": _tool(units),
        "SMC_GROUPGETCONTINUETOOLOFFSET": _continue_tool(units, numbers),
    }


def _tool(units: UserUnits) -> BlockType:
    """SMC_GroupReadTool, with Enable and Valid (assumed); not valid: no such movement."""

    def read(frame: Frame, slot: dict[str, int]) -> None:
        group: AxisGroup = frame[0]
        try:
            tool = group.read_tool(ReadToolMode(frame[slot["readmode"]]))
        except BlockRefused:
            frame[slot["valid"]] = False
            return
        frame[slot["tooloffset"]][:] = units.given(CoordRef.of(tool.frame))

    pins: Pins = (("readmode", READ_MODE, "var_input"), ("tooloffset", COORD_REF, "var_output"))
    return _reading("SMC_GroupReadTool", pins, read)


def _continue_tool(units: UserUnits, numbers: ErrorNumbers) -> BlockType:
    """SMC_GroupGetContinueToolOffset: at the rising edge, the tool of what was interrupted."""
    pins: Pins = (
        ("axisgroup", AXIS_GROUP, "var_in_out"),
        ("continuedata", CONTINUE_DATA, "var_in_out"),
        ("execute", BOOL, "var_input"),
        ("done", BOOL, "var_output"),
        ("busy", BOOL, "var_output"),
        ("error", BOOL, "var_output"),
        ("errorid", ERROR_ID, "var_output"),
        ("tooloffset", COORD_REF, "var_output"),
    )
    members = members_named(pins)
    slot = {pin: member.slot for pin, member in members.items()}

    def run(frame: Frame) -> None:
        ended = frame[slot["done"]] or frame[slot["error"]]
        if ended and frame[slot["execute"]]:
            return
        done, number, group = False, 0, frame[0]
        if frame[slot["execute"]]:
            try:
                tool = group.continue_tool_offset()
                frame[slot["tooloffset"]][:] = units.given(CoordRef.of(tool.frame))
                done = True
            except BlockRefused as refused:
                number = numbers.number(SmcError(refused.kind))
        frame[slot["done"]], frame[slot["error"]] = done, number != 0
        frame[slot["errorid"]] = number

    return BlockType("SMC_GroupGetContinueToolOffset", members, run)


def _reading(name: str, outputs: Pins, read: Callable[[Frame, dict[str, int]], None]) -> BlockType:
    members = members_named((*_ENABLE, *outputs))
    slot = {pin: member.slot for pin, member in members.items()}

    def run(frame: Frame) -> None:
        frame[slot["valid"]] = frame[slot["enable"]]
        if frame[slot["enable"]]:
            read(frame, slot)

    return BlockType(name, members, run)


def _status() -> BlockType:
    def read(frame: Frame, slot: dict[str, int]) -> None:
        group: AxisGroup = frame[0]
        for pin, state in _STATES.items():
            frame[slot[pin]] = group.state is state

    others = (("trackingdynamiccs", BOOL, "var_output"), ("insync", BOOL, "var_output"))
    pins = (*((pin, BOOL, "var_output") for pin in _STATES), *others)
    return _reading("MC_GroupReadStatus", pins, read)


def _error(numbers: ErrorNumbers) -> BlockType:
    def read(frame: Frame, slot: dict[str, int]) -> None:
        group: AxisGroup = frame[0]
        error = group.status().error
        frame[slot["grouperrorid"]] = 0 if error is None else numbers.number(error)

    return _reading("MC_GroupReadError", (("grouperrorid", ERROR_ID, "var_output"),), read)


def _position(units: UserUnits) -> BlockType:
    def read(frame: Frame, slot: dict[str, int]) -> None:
        group: AxisGroup = frame[0]
        system = CoordSystem(frame[slot["coordsystem"]])
        if system is CoordSystem.ACS:
            values = units.given_axes(group.values, group.kinematics.kinds)
        else:
            values = units.given(CoordRef(*group.read_actual_position(system).values))
        frame[slot["position"]][0][:] = values

    pins: Pins = (("coordsystem", COORD_SYSTEM, "var_input"), ("position", POSITION, "var_output"))
    return _reading("MC_GroupReadActualPosition", pins, read)
