"""The opcodes that move the axis group, or change its state.

Source: docs/reference/mailbox.md, "Movements".
"""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from robolink.protocols.mailbox import Answer, Command, ErrorClass, Opcode
from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.group.jog import COORDINATES, JogCommand
from robolink_simulators.softmotion.group.movement import EdgeWatch, SmcBufferMode
from robolink_simulators.softmotion.group.paths import Dynamics, Target
from robolink_simulators.softmotion.kinematics.kinematics import CoordSystem
from robolink_simulators.softmotion.mailbox.image import UserUnits
from robolink_simulators.softmotion.mailbox.jobs import (
    CommandResult,
    Handler,
    Job,
    Jobs,
    Rejected,
    ok,
    require_finite,
    require_operand,
)
from robolink_simulators.softmotion.signals import SIGNALS

MOST_MOVEMENTS: Final = 4
_MASKS: Final = range(1 << COORDINATES)


class MotionDesk:
    """Calls the blocks of the axis group.

    Args:
        group: The axis group.
        units: Of the mailbox.
        jobs: The commands that were accepted.

    Attributes:
        opcodes: What it can do.
    """

    def __init__(self, group: AxisGroup, units: UserUnits, jobs: Jobs) -> None:
        self._group = group
        self._units = units
        self._jobs = jobs
        self._releases: list[BlockExecution] = []
        self.opcodes: Mapping[int, Handler] = MappingProxyType(
            {
                Opcode.ENABLE: lambda _: CommandResult(group.enable()),
                Opcode.DISABLE: lambda _: CommandResult(group.disable()),
                Opcode.RESET: lambda _: CommandResult(group.reset()),
                Opcode.CONTINUE: lambda _: CommandResult(group.resume()),
                Opcode.INTERRUPT: lambda _: CommandResult(group.interrupt()),
                Opcode.HALT: lambda _: CommandResult(group.halt()),
                Opcode.STOP: self._stop,
                Opcode.JOG: self._jog,
                Opcode.MOVE_DIRECT: self._move_direct,
                Opcode.MOVE_LINEAR: self._move_linear,
                Opcode.MOVE_UNTIL_INPUT: self._move_until_input,
            }
        )

    def latched(self, job: Job) -> Answer | None:
        """Return where a movement until an input met the edge, if it has by now."""
        tcp = job.execution.latched
        return None if tcp is None else Answer.of_pose(self._units.given(tcp))

    def follow(self) -> None:
        """A release is done when the group has left Stopping."""
        if self._releases and self._group.state is not SmcGroupState.STOPPING:
            for release in self._releases:
                release.finish()
            self._releases.clear()

    def _stop(self, command: Command) -> CommandResult:
        if require_operand(command.operands[0], range(2)) == 0:
            return CommandResult(self._group.stop())
        if self._group.state is not SmcGroupState.STOPPING:
            return ok()  # there is nothing to hold (assumed)
        self._group.release_stop()
        release = BlockExecution()
        self._releases.append(release)
        return CommandResult(release)

    def _jog(self, command: Command) -> CommandResult:
        forward, backward, system, _ = command.operands
        for mask in (forward, backward):
            require_operand(mask, _MASKS)
        require_operand(system, range(len(CoordSystem)))
        pressed = JogCommand(forward, backward, CoordSystem(system), Dynamics(*command.dynamics))
        if not any(pressed.directions):
            return self._end_jog()
        dynamics = self._units.dynamics(command.dynamics, factors=pressed.by_factor)
        return CommandResult(self._group.jog(replace(pressed, dynamics=dynamics)))

    def _end_jog(self) -> CommandResult:
        jog = self._group.motion.jog
        if jog is not None:
            jog.release()
        return ok()

    def _move_direct(self, command: Command) -> CommandResult:
        target, mode = self._target(command)
        factors = self._units.dynamics(command.dynamics, factors=True)
        return CommandResult(self._group.move_direct_absolute(target, factors, mode=mode))

    def _move_linear(self, command: Command) -> CommandResult:
        return self._on_a_line(command, None)

    def _move_until_input(self, command: Command) -> CommandResult:
        signal, run_on, *_ = command.operands
        number = require_operand(abs(signal), range(SIGNALS))
        stops = require_operand(run_on, range(2)) == 0
        return self._on_a_line(command, EdgeWatch(number, falling=signal < 0, stops=stops))

    def _on_a_line(self, command: Command, watch: EdgeWatch | None) -> CommandResult:
        target, mode = self._target(command)
        dynamics = self._units.dynamics(command.dynamics)
        return CommandResult(
            self._group.move_linear_absolute(target, dynamics, mode=mode, watch=watch)
        )

    def _target(self, command: Command) -> tuple[Target, SmcBufferMode]:
        _, _, system, mode = command.operands
        require_operand(system, range(len(CoordSystem)))
        require_operand(mode, range(len(SmcBufferMode)))
        require_finite(command.pose)
        if len(self._jobs.movements) >= MOST_MOVEMENTS:
            raise Rejected(ErrorClass.QUEUE_FULL)
        if mode and any(map(_ends_anywhere, self._jobs.movements)):
            raise Rejected(ErrorClass.MOVING)
        if system == CoordSystem.ACS:
            position = self._units.axes(command.pose, self._group.kinematics.kinds)
        else:
            position = self._units.pose(command.pose)
        return Target(position, CoordSystem(system)), SmcBufferMode(mode)


def _ends_anywhere(job: Job) -> bool:
    """Whether a movement stops at an edge, be it interrupted: where is not known before."""
    _, runs_on, *_ = job.command.operands
    return job.command.opcode == Opcode.MOVE_UNTIL_INPUT and not runs_on
