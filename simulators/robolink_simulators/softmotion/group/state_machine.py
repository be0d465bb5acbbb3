"""The states of an axis group in simulated time (docs/reference/softmotion.md 2.2)."""

from collections.abc import Callable
from typing import Final

from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.axes import Axis
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.group.motion import GroupMotion
from robolink_simulators.softmotion.options import GroupOptions
from robolink_simulators.softmotion.smc_errors import (
    BlockRefused,
    ErrorKind,
    Overruled,
    SmcError,
)

_LEFT_AT_REST: Final = (SmcGroupState.MOVING, SmcGroupState.STOPPING)


class StateMachine:
    """State, error and time of a group. Blocks call it; it moves the axes.

    Args:
        axes: Gives the group's drives.
        motion: What moves them.
        options: The group's habits.

    Attributes:
        state: State of the group.
        error: The group error, which only a reset takes away.
        stop_held: Whether a stop locks the group: its ``Execute`` has not fallen.
        now_ns: The instant given last.
    """

    def __init__(
        self, axes: Callable[[], tuple[Axis, ...]], motion: GroupMotion, options: GroupOptions
    ) -> None:
        self.state = SmcGroupState.DISABLED
        self.error: SmcError | None = None
        self.stop_held = False
        self.now_ns = 0
        self._axes = axes
        self._motion = motion
        self._options = options
        self._cycle_ns = options.cycle_us * 1000
        self._ending: list[BlockExecution] = []
        self._rest_ns: int | None = None

    def require_motion(self) -> None:
        """Refuse where no movement or jog may begin.

        Raises:
            Refused: The state, the power or an axis does not allow it.
            Overruled: A stop is held, and the options say so.
        """
        if self._options.program_task != "motion":
            text = "A movement block was called outside of the motion task"
            raise BlockRefused(ErrorKind.OUTSIDE_MOTION_TASK, text)
        if self.stop_held and self._options.movement_while_stopping == "aborted":
            raise Overruled
        if self.state not in (SmcGroupState.STANDBY, SmcGroupState.MOVING):
            raise BlockRefused(ErrorKind.WRONG_STATE, f"Not in {self.state.name}")
        if self._motion.interrupting:
            raise BlockRefused(ErrorKind.WRONG_STATE, "An interrupt is under way")
        if any(axis.failed for axis in self._axes()):
            raise BlockRefused(ErrorKind.AXIS_ERROR, "An axis is in error")
        if not all(axis.powered for axis in self._axes()):
            raise BlockRefused(ErrorKind.NO_POWER, "A drive has no power")
        if any(axis.moving_alone for axis in self._axes()):
            text = "An axis of the group is moving alone"
            self.fail(ErrorKind.INTERRUPTED_BY_SINGLE_AXIS, text)
            raise BlockRefused(ErrorKind.INTERRUPTED_BY_SINGLE_AXIS, text)

    def begin_motion(self) -> None:
        """Note that something moves the group; a halt in progress ends for it (assumed)."""
        self._abort_endings()
        self._rest_ns = None
        self.state = SmcGroupState.MOVING
        for axis in self._axes():
            axis.couple()

    def begin_halt(self, execution: BlockExecution) -> None:
        """Stop and be in Standby a cycle later."""
        self.begin_motion()
        self._motion.brake(self.now_ns)
        self._ending = [execution]

    def begin_interrupt(self, execution: BlockExecution) -> None:
        """Stop on the path and keep what is left."""
        self._motion.interrupt(self.now_ns)
        self._ending = [execution]

    def begin_stop(self, execution: BlockExecution) -> None:
        """Stop and stay locked until :meth:`release_stop`; another stop joins in."""
        self.stop_held = True
        if self.state is SmcGroupState.STOPPING:
            self._ending.append(execution)
            if self._rest_ns is not None:
                self._finish_endings()
            return
        self.begin_motion()
        self._motion.brake(self.now_ns)
        self.state = SmcGroupState.STOPPING
        self._ending = [execution]

    def release_stop(self) -> None:
        """Let ``Execute`` of the stop fall; once at rest, Standby follows a cycle later."""
        if self._rest_ns is not None:
            self._rest_ns = self.now_ns
        self.stop_held = False

    def fail(self, kind: ErrorKind, text: str, number: int | None = None) -> None:
        """Go to ErrorStop: everything ends where it is (assumed: without slowing down).

        Args:
            kind: What happened.
            text: For the log.
            number: ErrorID of a drive, where it has one of its own.
        """
        error = self._options.numbers.error(kind, text)
        if number is not None:
            error = SmcError(kind, number, text)
        as_error = self._options.queue_on_error == "error"
        self._end_everything(error if as_error else None)
        self.state, self.error = SmcGroupState.ERROR_STOP, error
        for axis in self._axes():
            axis.fail()

    def enable(self) -> None:
        """Leave Disabled for Standby.

        Raises:
            Refused: It is not Disabled.
        """
        if self.state is not SmcGroupState.DISABLED:
            raise BlockRefused(ErrorKind.WRONG_STATE, f"Not DISABLED but {self.state.name}")
        self.state = SmcGroupState.STANDBY

    def disable(self) -> None:
        """Go to Disabled; what was unfinished ends with CommandAborted.

        Raises:
            Refused: The state does not allow it.
        """
        anywhere = self._options.disable_from == "any" and self.state is not SmcGroupState.DISABLED
        if self.state is not SmcGroupState.STANDBY and not anywhere:
            raise BlockRefused(ErrorKind.WRONG_STATE, f"Not STANDBY but {self.state.name}")
        self._end_everything(None)
        self.state, self.error = SmcGroupState.DISABLED, None
        self._free_axes()

    def reset(self) -> None:
        """Leave ErrorStop for Standby, and take the errors off the axes.

        Raises:
            Refused: There is nothing to reset.
        """
        failed = [axis for axis in self._axes() if axis.failed]
        if self.state is not SmcGroupState.ERROR_STOP and not failed:
            raise BlockRefused(ErrorKind.NOTHING_TO_RESET, f"Not in {self.state.name}")
        for axis in failed:
            axis.failed = False
        if self.state is SmcGroupState.ERROR_STOP:
            self.state, self.error = SmcGroupState.STANDBY, None

    def restart(self) -> None:
        """Start the PLC anew: what moved stops where it is, the group is Disabled."""
        self._end_everything(None)
        self.state, self.error = SmcGroupState.DISABLED, None
        self._free_axes()

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``, stopping wherever something changes."""
        while (change := self.next_change()) is not None and change <= now_ns:
            self.now_ns = change
            self._step()
        self.now_ns = max(now_ns, self.now_ns)
        self._guarded(self._motion.follow)

    def next_change(self) -> int | None:
        """Return when :meth:`advance` will next do something by itself, if ever."""
        change = self._motion.next_change(self.now_ns)
        if not self._settled or (self._rest_ns is not None and self.stop_held):
            return change
        cycle_ns = self._cycle_after(self.now_ns)
        return cycle_ns if change is None else min(change, cycle_ns)

    def _step(self) -> None:
        self._guarded(self._motion.step)
        if not self._settled:
            return
        if self._rest_ns is None:
            self._rest_ns = self.now_ns
            if self._motion.interrupting:
                self._motion.keep_interrupted()
            self._finish_endings()
        elif not self.stop_held and self.now_ns >= self._cycle_after(self._rest_ns):
            self._enter_standby()

    def _end_everything(self, error: SmcError | None) -> None:
        self._motion.drop(error)
        self._abort_endings()
        self._rest_ns = None
        self.stop_held = False

    def _finish_endings(self) -> None:
        for execution in self._ending:
            execution.finish()
        self._ending = []

    def _abort_endings(self) -> None:
        for execution in self._ending:
            execution.abort()
        self._ending = []

    def _guarded(self, act: Callable[[int], None]) -> None:
        try:
            act(self.now_ns)
        except BlockRefused as refused:
            self.fail(refused.kind, refused.text)

    def _enter_standby(self) -> None:
        self._rest_ns = None
        self.state = SmcGroupState.STANDBY
        if self._options.axes_follow_group:
            self._free_axes()

    @property
    def _settled(self) -> bool:
        """Whether the group is at rest in a state that it leaves for that."""
        return self._motion.resting and self.state in _LEFT_AT_REST

    def _cycle_after(self, now_ns: int) -> int:
        return (now_ns // self._cycle_ns + 1) * self._cycle_ns

    def _free_axes(self) -> None:
        for axis in self._axes():
            axis.free()
