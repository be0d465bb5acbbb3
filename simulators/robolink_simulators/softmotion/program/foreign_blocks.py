"""The function blocks of SoftMotion that a program calls, on the simulated axis group.

They act on the rising edge of ``Execute``, sample their inputs there, and keep their outputs until
it falls (docs/reference/softmotion.md 2.5). Pins are those of docs/reference/softmotion.md 1 and 2.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.group.condition import ReadToolMode, SmcGroupState
from robolink_simulators.softmotion.group.jog import JogCommand
from robolink_simulators.softmotion.group.movement import SmcBufferMode
from robolink_simulators.softmotion.group.paths import Dynamics, Target
from robolink_simulators.softmotion.kinematics.kinematics import (
    CoordRef,
    CoordSystem,
    KinematicsModel,
)
from robolink_simulators.softmotion.mailbox.image import UserUnits
from robolink_simulators.softmotion.program.foreign_types import (
    AXIS_GROUP,
    BUFFER_MODE,
    CONTINUE_DATA,
    COORD_REF,
    COORD_SYSTEM,
    ERROR_ID,
    MASKS,
    POSITION,
    READ_MODE,
    ErrorNumbers,
)
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind, SmcError
from robolink_simulators.structured_text.data_types import (
    BOOL,
    LREAL,
    BlockType,
    DataType,
    Frame,
    OpaqueType,
    TextVariable,
)

Pins = Sequence[tuple[str, DataType, str]]
Act = Callable[[AxisGroup, Mapping[str, Any]], BlockExecution]

_IN, _OUT, _BOTH = "var_input", "var_output", "var_in_out"
_GROUP: Final[Pins] = (("axisgroup", AXIS_GROUP, _BOTH),)
_EXECUTE: Final[Pins] = (*_GROUP, ("execute", BOOL, _IN))
_ENDS: Final[Pins] = (
    ("done", BOOL, _OUT),
    ("busy", BOOL, _OUT),
    ("active", BOOL, _OUT),
    ("commandaborted", BOOL, _OUT),
    ("error", BOOL, _OUT),
    ("errorid", ERROR_ID, _OUT),
)
_DYNAMICS: Final[Pins] = tuple(
    (name, LREAL, _IN) for name in ("velocity", "acceleration", "deceleration", "jerk")
)
_FACTORS: Final[Pins] = tuple(
    (name, LREAL, _IN) for name in ("velfactor", "accfactor", "jerkfactor")
)
_TARGET: Final[Pins] = (
    ("position", POSITION, _IN),
    ("coordsystem", COORD_SYSTEM, _IN),
    ("buffermode", BUFFER_MODE, _IN),
)
_CONTINUE: Final[Pins] = (("continuedata", CONTINUE_DATA, _BOTH),)


class MotionBlocks:
    """Makes the blocks that act.

    Args:
        units: Between user units and those of the simulated group.
        numbers: Of complaints.
        kinematics: What ``MC_SetKinTransform`` is given.
    """

    def __init__(
        self, units: UserUnits, numbers: ErrorNumbers, kinematics: KinematicsModel
    ) -> None:
        self._units = units
        self._numbers = numbers
        self._kinematics = kinematics

    def blocks(self, kinematics_type: DataType) -> Mapping[str, BlockType]:
        """Return the blocks by name.

        Args:
            kinematics_type: What ``MC_SetKinTransform`` takes.
        """
        transform: Pins = (("kintransform", kinematics_type, _BOTH),)
        rows: Sequence[tuple[str, Pins, Act]] = (
            ("SMC_GroupSetTool", (("tooloffset", COORD_REF, _IN),), self._set_tool),
            ("MC_GroupEnable", (), lambda group, _: group.enable()),
            ("MC_GroupDisable", (), lambda group, _: group.disable()),
            ("MC_GroupReset", (), lambda group, _: group.reset()),
            ("MC_GroupInterrupt", _CONTINUE, lambda group, _: group.interrupt()),
            ("MC_GroupContinue", _CONTINUE, lambda group, _: group.resume()),
            ("MC_GroupHalt", (), lambda group, _: group.halt()),
            ("MC_SetKinTransform", transform, self._set_kinematics),
            ("MC_MoveLinearAbsolute", (*_TARGET, *_DYNAMICS), self._linear),
            ("MC_MoveDirectAbsolute", (*_TARGET, *_FACTORS), self._direct),
        )
        made = {name.upper(): self._acting(name, pins, act) for name, pins, act in rows}
        made["MC_GROUPSTOP"] = self._acting(
            "MC_GroupStop", (), lambda group, _: group.stop(), falls=AxisGroup.release_stop
        )
        made["SMC_GROUPJOG2"] = self._jogging()
        return made

    def _acting(
        self,
        name: str,
        inputs: Pins,
        act: Act,
        falls: Callable[[AxisGroup], None] | None = None,
    ) -> BlockType:
        pins = (*_EXECUTE, *inputs, *_ENDS, ("running", OpaqueType("execution"), "private"))
        members = members_named(pins)
        slot = {pin: member.slot for pin, member in members.items()}
        execute, running = slot["execute"], slot["running"]

        def run(frame: Frame) -> None:
            execution: BlockExecution | None = frame[running]
            if frame[execute] and execution is None:
                given = {pin: frame[slot[pin]] for pin, _, _ in inputs}
                execution = frame[running] = act(frame[0], given)
            elif not frame[execute] and execution is not None:
                if falls is not None:
                    falls(frame[0])
                execution = frame[running] = None
            self._show(frame, slot, execution)

        return BlockType(name, members, run)

    def _show(
        self, frame: Frame, slot: Mapping[str, int], execution: BlockExecution | None
    ) -> None:
        outputs = None if execution is None else execution.outputs
        error = None if outputs is None else outputs.error
        frame[slot["done"]] = outputs is not None and outputs.done
        frame[slot["busy"]] = outputs is not None and outputs.busy
        frame[slot["active"]] = outputs is not None and outputs.active
        frame[slot["commandaborted"]] = outputs is not None and outputs.aborted
        frame[slot["error"]] = error is not None
        frame[slot["errorid"]] = 0 if error is None else self._numbers.number(error)

    def _jogging(self) -> BlockType:
        """SMC_GroupJog2 has no ``Execute``: it jogs while a button is pressed (documented)."""
        inputs: Pins = (
            ("forward", MASKS, _IN),
            ("backward", MASKS, _IN),
            ("coordsystem", COORD_SYSTEM, _IN),
            *_DYNAMICS,
            *_FACTORS,
        )
        pressed: Pins = (("pressed", OpaqueType("buttons"), "private"),)
        pins = (*_GROUP, *inputs, *_ENDS, ("running", OpaqueType("jog"), "private"), *pressed)
        members = members_named(pins)
        slot = {pin: member.slot for pin, member in members.items()}

        def run(frame: Frame) -> None:
            command = self._buttons({pin: frame[slot[pin]] for pin, _, _ in inputs})
            execution: BlockExecution | None = frame[slot["running"]]
            before: JogCommand | None = frame[slot["pressed"]]
            frame[slot["pressed"]] = command
            group: AxisGroup = frame[0]
            jogs = any(command.directions)
            if execution is None and jogs and command != before:
                frame[slot["running"]] = execution = group.jog(command)
            elif execution is not None and not execution.ended and command != before:
                _press(group, command, jogs=jogs)
            elif execution is not None and execution.ended and not jogs:
                frame[slot["running"]] = execution = None
            self._show(frame, slot, execution)

        return BlockType("SMC_GroupJog2", members, run)

    def _buttons(self, pins: Mapping[str, Any]) -> JogCommand:
        masks = [
            sum(1 << at for at, on in enumerate(pins[name]) if on)
            for name in ("forward", "backward")
        ]
        system = CoordSystem(pins["coordsystem"])
        numbers = Dynamics(*(pins[name] for name, _, _ in _DYNAMICS))
        command = JogCommand(masks[0], masks[1], system, numbers)
        if not any(command.directions):
            return command
        four = (numbers.velocity, numbers.acceleration, numbers.deceleration, numbers.jerk)
        scaled = self._units.dynamics(four, factors=command.by_factor)
        return JogCommand(masks[0], masks[1], system, scaled)

    def _set_tool(self, group: AxisGroup, pins: Mapping[str, Any]) -> BlockExecution:
        x, y, z, a, b, c = pins["tooloffset"]
        return group.set_tool(self._units.tool((x, y, z, a, b, c)))

    def _set_kinematics(self, group: AxisGroup, pins: Mapping[str, Any]) -> BlockExecution:
        given = pins["kintransform"]
        if isinstance(given, list) and None in given:  # Kin_Coupled without one of the two
            execution = BlockExecution()
            execution.fail(group.options.numbers.error(ErrorKind.AXES_MISMATCH))
            return execution
        return group.set_kin_transform(self._kinematics)

    def _target(self, group: AxisGroup, pins: Mapping[str, Any]) -> Target:
        (values,) = pins["position"]
        x, y, z, a, b, c = values
        six = (x, y, z, a, b, c)
        system = CoordSystem(pins["coordsystem"])
        if system is CoordSystem.ACS:
            return Target(self._units.axes(six, group.kinematics.kinds), system)
        return Target(self._units.pose(six), system)

    def _linear(self, group: AxisGroup, pins: Mapping[str, Any]) -> BlockExecution:
        v, a, d, j = (pins[name] for name, _, _ in _DYNAMICS)
        dynamics = self._units.dynamics((v, a, d, j))
        mode = SmcBufferMode(pins["buffermode"])
        return group.move_linear_absolute(self._target(group, pins), dynamics, mode=mode)

    def _direct(self, group: AxisGroup, pins: Mapping[str, Any]) -> BlockExecution:
        v, a, j = (pins[name] for name, _, _ in _FACTORS)
        mode = SmcBufferMode(pins["buffermode"])
        factors = Dynamics(v, a, a, j)
        return group.move_direct_absolute(self._target(group, pins), factors, mode=mode)


def _press(group: AxisGroup, command: JogCommand, *, jogs: bool) -> None:
    jog = group.motion.jog
    if jog is None:
        return
    if jogs:
        jog.press(command)
    else:
        jog.release()


def members_named(pins: Pins) -> dict[str, TextVariable]:
    """Return the pins of a block by name, in order."""
    return {name: TextVariable(name, of, slot, kind) for slot, (name, of, kind) in enumerate(pins)}


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
