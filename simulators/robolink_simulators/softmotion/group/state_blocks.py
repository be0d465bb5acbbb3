"""The blocks that change the state of an axis group (docs/reference/softmotion.md 2.2, 2.3)."""

from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.group.core import GroupCore, block
from robolink_simulators.softmotion.kinematics.coordinates import CoordinateTransforms
from robolink_simulators.softmotion.kinematics.kinematics import KinematicsModel
from robolink_simulators.softmotion.motion.movement import ToolInForce
from robolink_simulators.softmotion.signals import DigitalOutputs
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind, Overruled

_SAME_PLACE = 1e-6


class StateBlocks(GroupCore):
    """Power, enable and disable, reset, and every way of coming to rest."""

    def power(self, *, on: bool) -> None:
        """``MC_Power`` of every drive; off while moving or stopping is a group error."""
        if not on and self.state in (SmcGroupState.MOVING, SmcGroupState.STOPPING):
            self.machine.fail(ErrorKind.NO_POWER, "The power of the drives was switched off")
        if not on:
            self.motion.abort_singles(self.drives)
        for axis in self.drives:
            axis.switch(on)

    def restart(self, kinematics: KinematicsModel) -> None:
        """Start the PLC: Disabled, without a tool, with the kinematics of its project.

        Drives keep their place, their power and their errors.
        """
        self.machine.restart()
        self.motion.queue.last = None
        self.kinematics = kinematics
        self.tool = ToolInForce()
        self.transforms = CoordinateTransforms()
        self.outputs = DigitalOutputs()

    def fail_axis(self, number: int, error_number: int | None = None) -> None:
        """Let a drive fail, as the world may: an enabled group goes to ErrorStop.

        Args:
            number: Which axis.
            error_number: Its ``SMC_ERROR``, for example 16 for a lag error.
        """
        self.motion.abort_singles(self.axes[number : number + 1])
        self.axes[number].fail()
        if self.state is not SmcGroupState.DISABLED:
            self.machine.fail(ErrorKind.AXIS_ERROR, f"Axis {number} failed", error_number)

    @block
    def enable(self, execution: BlockExecution) -> None:
        """``MC_GroupEnable``: Disabled to Standby."""
        self.machine.enable()
        execution.finish()

    @block
    def disable(self, execution: BlockExecution) -> None:
        """``MC_GroupDisable``: Standby to Disabled; interrupted movements end."""
        self.machine.disable()
        execution.finish()

    @block
    def reset(self, execution: BlockExecution) -> None:
        """``MC_GroupReset``: ErrorStop to Standby."""
        self.machine.reset()
        execution.finish()

    @block
    def stop(self, execution: BlockExecution) -> None:
        """``MC_GroupStop`` with ``Execute`` held: Done at rest, locked until released."""
        self._require_enabled()
        self.machine.begin_stop(execution)

    def release_stop(self) -> None:
        """Let ``Execute`` of the stop fall; Standby follows a cycle after rest."""
        self.machine.release_stop()

    @block
    def halt(self, execution: BlockExecution) -> None:
        """``MC_GroupHalt``: come to rest through Moving to Standby."""
        self._require_unlocked()
        if self.motion.interrupting:
            raise BlockRefused(ErrorKind.WRONG_STATE, "An interrupt is under way")
        self.machine.begin_halt(execution)

    @block
    def interrupt(self, execution: BlockExecution) -> None:
        """``MC_GroupInterrupt``: come to rest on the path; the movements stay busy."""
        self._require_unlocked()
        if self.motion.interrupting:
            raise Overruled
        if self.motion.interrupted:
            raise BlockRefused(ErrorKind.WRONG_STATE, "An interrupted movement waits")
        if not self.motion.queue.unfinished:
            raise BlockRefused(ErrorKind.NO_SUCH_MOVEMENT, "There is nothing to interrupt")
        self.machine.begin_interrupt(execution)

    @block
    def resume(self, execution: BlockExecution) -> None:
        """``MC_GroupContinue``: go on with what was interrupted, each with its own tool."""
        self._require_unlocked()
        if self.state is not SmcGroupState.STANDBY:
            raise BlockRefused(ErrorKind.WRONG_STATE, f"Not STANDBY but {self.state.name}")
        if not self.motion.interrupted:
            raise BlockRefused(ErrorKind.NO_SUCH_MOVEMENT, "There is nothing to continue")
        self.machine.require_motion()
        away = zip(self.values, self.motion.interrupted_at, strict=True)
        if any(abs(a - b) > _SAME_PLACE for a, b in away):
            text = "The group does not stand where it was interrupted"
            raise BlockRefused(ErrorKind.NOT_AT_CONTINUE_POSITION, text)
        self.machine.begin_motion()
        self.motion.resume(self.now_ns)
        execution.finish()

    def _require_enabled(self) -> None:
        if self.state in (SmcGroupState.DISABLED, SmcGroupState.ERROR_STOP):
            raise BlockRefused(ErrorKind.WRONG_STATE, f"In {self.state.name}")

    def _require_unlocked(self) -> None:
        """Refuse in Disabled and ErrorStop; a stop that is held overrules (documented)."""
        self._require_enabled()
        if self.state is SmcGroupState.STOPPING:
            raise Overruled
