"""The memory and the drives of an axis group, and what makes a method a function block."""

from collections.abc import Callable, Sequence
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar

from robolink_simulators.cell.frames import Frame
from robolink_simulators.device.wire_record import MotionLog
from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.axes import ASSUMED_LIMITS, Axis, AxisLimits
from robolink_simulators.softmotion.group.condition import GroupStatus, SmcGroupState
from robolink_simulators.softmotion.group.motion import GroupMotion
from robolink_simulators.softmotion.group.movement import ToolInForce
from robolink_simulators.softmotion.group.paths import require_inside
from robolink_simulators.softmotion.group.state_machine import StateMachine
from robolink_simulators.softmotion.kinematics.kinematics import (
    AxisValues,
    CoordinateTransforms,
    KinematicsModel,
)
from robolink_simulators.softmotion.options import GroupOptions
from robolink_simulators.softmotion.signals import DigitalInputs, DigitalOutputs
from robolink_simulators.softmotion.smc_errors import BlockRefused, Overruled

Inputs = ParamSpec("Inputs")
Core = TypeVar("Core", bound="GroupCore")


def block(
    method: Callable[Concatenate[Core, BlockExecution, Inputs], None],
) -> Callable[Concatenate[Core, Inputs], BlockExecution]:
    """Make a method a function block: it returns its execution, and errors are outputs."""

    @wraps(method)
    def executed(core: Core, /, *args: Inputs.args, **kwargs: Inputs.kwargs) -> BlockExecution:
        execution = BlockExecution()
        try:
            method(core, execution, *args, **kwargs)
        except BlockRefused as refused:
            execution.fail(core.options.numbers.error(refused.kind, refused.text))
        except Overruled:
            execution.abort()
        return execution

    return executed


class GroupCore:
    """An axis group without its blocks.

    Args:
        kinematics: What connects axes and flange.
        limits: Of each drive, a0 first; ``ASSUMED_LIMITS`` by default.
        options: The group's habits.

    The drives have no power and the group is disabled at first.

    Attributes:
        options: The group's habits.
        kinematics: What connects axes and flange.
        transforms: Where the coordinate systems stand (MC_SetCoordinateTransform).
        inputs: Digital inputs.
        outputs: Digital outputs.
        tool: The selected tool for movements to come.
        motions: Movements and jogs accepted.
        motion: What moves the drives.
        machine: State and time.
    """

    def __init__(
        self,
        kinematics: KinematicsModel,
        limits: Sequence[AxisLimits] | None = None,
        options: GroupOptions | None = None,
    ) -> None:
        self.options = options or GroupOptions()
        if limits is None:
            limits = [ASSUMED_LIMITS[kind] for kind in kinematics.kinds]
        rows = zip(kinematics.kinds, limits, strict=True)
        self._drives = tuple(Axis(n, kind, given) for n, (kind, given) in enumerate(rows))
        self.kinematics = kinematics
        self.transforms = CoordinateTransforms()
        self.inputs = DigitalInputs()
        self.outputs = DigitalOutputs()
        self.tool = ToolInForce()
        self.motions = MotionLog()
        self.motion = GroupMotion(lambda: self.axes, self.inputs, self.options)
        self.machine = StateMachine(lambda: self.axes, self.motion, self.options)

    @property
    def movements_started(self) -> int:
        """Movements and jogs accepted so far; a repeated command shows here."""
        return self.motions.added

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The drives that belong to the kinematics."""
        return self._drives[: len(self.kinematics.kinds)]

    @property
    def drives(self) -> tuple[Axis, ...]:
        """Every drive there is."""
        return self._drives

    @property
    def values(self) -> AxisValues:
        """Where the axes are."""
        return self.motion.values

    @property
    def state(self) -> SmcGroupState:
        """State of the group."""
        return self.machine.state

    @property
    def now_ns(self) -> int:
        """The instant last given."""
        return self.machine.now_ns

    def flange(self) -> Frame:
        """Return where the flange is, in MCS."""
        return self.kinematics.flange(self.values)

    @property
    def interrupted_movement(self) -> int:
        """Number of the movement that was interrupted first and may go on, 0 for none."""
        held_back = self.motion.interrupted
        return held_back[0].number if held_back else 0

    def status(self) -> GroupStatus:
        """``MC_GroupReadStatus``, ``MC_GroupReadError`` and the power of the drives."""
        active = self.motion.queue.active
        return GroupStatus(
            state=self.state,
            active_movement=0 if active is None else active.number,
            unfinished=len(self.motion.queue.unfinished) + len(self.motion.interrupted),
            interrupted_movement=self.interrupted_movement,
            jogging=self.motion.jog is not None,
            powered=all(axis.powered for axis in self.axes),
            error=self.machine.error,
        )

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``, stopping wherever something changes."""
        self.machine.advance(now_ns)

    def next_change(self) -> int | None:
        """Return when :meth:`advance` will next do something by itself, if ever."""
        return self.machine.next_change()

    def place(self, values: AxisValues) -> None:
        """Put the axes somewhere, as a hand does: no block is involved.

        Raises:
            Refused: An axis would leave its limits.
        """
        require_inside(values, self.axes)
        for axis, value in zip(self.axes, values, strict=True):
            axis.value = value
