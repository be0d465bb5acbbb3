"""The blocks that move an axis group (docs/reference/softmotion.md 2.3, 2.4)."""

from robolink_simulators.cell.frames import ORIGIN, Frame
from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.group.core import GroupCore, block
from robolink_simulators.softmotion.kinematics.coordinates import CoordSystem
from robolink_simulators.softmotion.kinematics.kinematics import AxisValues
from robolink_simulators.softmotion.motion.jog import JogCommand, JogMotion
from robolink_simulators.softmotion.motion.movement import EdgeWatch, Movement, SmcBufferMode
from robolink_simulators.softmotion.motion.paths import Dynamics, Path
from robolink_simulators.softmotion.motion.planner import Planner, Target
from robolink_simulators.softmotion.motion.profile import Pace
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind


class MoveBlocks(GroupCore):
    """Movements, jogging, and single axes."""

    @block
    def move_linear_absolute(
        self,
        execution: BlockExecution,
        target: Target,
        dynamics: Dynamics,
        *,
        mode: SmcBufferMode = SmcBufferMode.ABORTING,
        watch: EdgeWatch | None = None,
    ) -> None:
        """``MC_MoveLinearAbsolute``: the TCP on a straight line, the elbow on its side.

        With ``watch``, as the companion program's movement until an input (docs/mailbox.md,
        opcode 30008): ``execution.latched`` is the TCP at the edge, in the coordinate system
        of the target; without an edge the block ends in error.
        """
        self.machine.require_motion()
        if watch is not None:
            self.inputs.read(watch.number, self.values)
        mode = self._effective(mode, continuous=True)
        start = self._start(mode)
        planner = self._planner()
        path, pace = planner.line(start, target, self.tool.frame, dynamics)
        base = planner.base(start, target.system, self.tool.frame)
        system = target.system
        self._begin(path, pace, mode, execution, base=base, watch=watch, system=system)

    @block
    def move_direct_absolute(
        self,
        execution: BlockExecution,
        target: Target,
        factors: Dynamics,
        *,
        mode: SmcBufferMode = SmcBufferMode.ABORTING,
    ) -> None:
        """``MC_MoveDirectAbsolute``: straight in axis space, by factors of the axes' limits."""
        self.machine.require_motion()
        mode = self._effective(mode, continuous=False)
        start = self._start(mode)
        path, pace = self._planner().direct(start, target, self.tool.frame, factors)
        self._begin(path, pace, mode, execution, system=target.system)

    @block
    def jog(self, execution: BlockExecution, command: JogCommand) -> None:
        """``SMC_GroupJog2``: starts a jog, which aborts what moves, or presses other buttons.

        It begins when what moved has come to rest. The execution of the first call tells how
        the jog ends; those of later ones are done at once.
        """
        self.machine.require_motion()
        if self.motion.jog is not None:
            self.motion.jog.press(command)
            execution.finish()
            return
        if not any(command.directions):
            execution.finish()
            return
        jog = JogMotion(
            command,
            self.kinematics,
            tool=self.tool.frame,
            transforms=self.transforms,
            axes=self.axes,
            execution=execution,
        )
        self.machine.begin_motion()
        self.motion.queue.take_over(self.now_ns)
        self.motions.add(self.now_ns)
        self.motion.jog = jog

    @block
    def move_axis(self, execution: BlockExecution, number: int, target: float) -> None:
        """``MC_MoveAbsolute`` of one member axis: while the group moves, a group error."""
        if not 0 <= number < len(self.axes):
            raise BlockRefused(ErrorKind.PARAMETER, f"There is no axis {number}")
        if self.state is SmcGroupState.MOVING:
            text = f"Axis {number} was commanded alone"
            self.machine.fail(ErrorKind.INTERRUPTED_BY_SINGLE_AXIS, text)
            raise BlockRefused(ErrorKind.INTERRUPTED_BY_SINGLE_AXIS, text)
        if self.state not in (SmcGroupState.DISABLED, SmcGroupState.STANDBY):
            raise BlockRefused(ErrorKind.WRONG_STATE, f"In {self.state.name}")
        self.motion.start_alone(self.axes[number], target, execution, now_ns=self.now_ns)

    def _planner(self) -> Planner:
        return Planner(self.kinematics, self.axes, self.transforms)

    def _effective(self, mode: SmcBufferMode, *, continuous: bool) -> SmcBufferMode:
        """Return Buffered where a change of tool does not let a movement join the one before.

        Between two CP movements neither Blending nor Aborting joins them (documented); between
        others Blending does not (documented on the page of SMC_GroupSetTool).
        """
        last = self.motion.queue.last
        if last is None or last.execution.ended or last.tool == self.tool:
            return mode
        both_continuous = last.continuous and continuous
        return SmcBufferMode.BUFFERED if both_continuous or mode.blends else mode

    def _start(self, mode: SmcBufferMode) -> AxisValues:
        """Return where a movement will begin."""
        queue = self.motion.queue
        if mode is SmcBufferMode.ABORTING:
            return queue.axes_if_braked(self.now_ns) or self.values
        if any(movement.watch and movement.watch.stops for movement in queue.unfinished):
            text = "Where a movement until an input ends is not known before"
            kind = ErrorKind.BLENDING_NOT_SUPPORTED if mode.blends else ErrorKind.WRONG_STATE
            raise BlockRefused(kind, text)
        return queue.last_axes() or self.values

    def _begin(
        self,
        path: Path,
        pace: Pace | None,
        mode: SmcBufferMode,
        execution: BlockExecution,
        *,
        base: Frame = ORIGIN,
        watch: EdgeWatch | None = None,
        system: CoordSystem,
    ) -> None:
        self.machine.begin_motion()
        self.motion.end_jog()
        if mode is SmcBufferMode.ABORTING:
            self.motion.queue.take_over(self.now_ns)
            execution.activate()
        kinematics = self.kinematics
        self.motions.add(self.now_ns, lambda: kinematics.flange(path.end).shift_mm)
        execution.movement_number = self.movements_started
        self.motion.queue.append(
            Movement(
                self.movements_started,
                path,
                pace,
                tool=self.tool,
                mode=mode,
                base=base,
                execution=execution,
                watch=watch,
                system=system,
            )
        )
