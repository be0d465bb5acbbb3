"""A simulated SoftMotion axis group: its function blocks as methods, in simulated time.

Theory of operation. A block acts at the instant that the group was given last and returns an
:class:`~robolink_simulators.softmotion.function_blocks.BlockExecution`, whose outputs change as
time passes. The group owns no thread and no clock: whoever hosts it calls ``advance`` and asks
``next_change`` when to call again.
"""

from robolink_simulators.cell.frames import ORIGIN, Frame
from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.condition import (
    ActualPosition,
    ReadToolMode,
    SmcGroupState,
)
from robolink_simulators.softmotion.group.core import GroupCore, block
from robolink_simulators.softmotion.group.jog import JogCommand, JogMotion
from robolink_simulators.softmotion.group.movement import (
    EdgeWatch,
    Movement,
    SmcBufferMode,
    ToolInForce,
)
from robolink_simulators.softmotion.group.paths import (
    Dynamics,
    Path,
    Planner,
    Position,
    Target,
    axes_for_tcp,
)
from robolink_simulators.softmotion.group.profile import Pace
from robolink_simulators.softmotion.kinematics.kinematics import (
    ANY_CONFIGURATION,
    AxisValues,
    Configuration,
    CoordinateTransforms,
    CoordRef,
    CoordSystem,
    KinematicsModel,
)
from robolink_simulators.softmotion.signals import DigitalOutputs
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind, Overruled


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

        With ``watch``, as the companion program's movement until an input
        (docs/reference/mailbox.md, opcode 30008): ``execution.latched`` is the TCP at the edge, in
        the coordinate system of the target; without an edge the block ends in error.
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


_SAME_PLACE = 1e-6


class StateBlocks(GroupCore):
    """Power, enable and disable, reset, and every way of stopping."""

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
        """``MC_GroupStop`` with ``Execute`` on: Done at rest, locked until released."""
        self._require_enabled()
        self.machine.begin_stop(execution)

    def release_stop(self) -> None:
        """Let ``Execute`` of the stop fall; Standby follows a cycle after rest."""
        self.machine.release_stop()

    @block
    def halt(self, execution: BlockExecution) -> None:
        """``MC_GroupHalt``: stop, through Moving to Standby."""
        self._require_unlocked()
        if self.motion.interrupting:
            raise BlockRefused(ErrorKind.WRONG_STATE, "An interrupt is under way")
        self.machine.begin_halt(execution)

    @block
    def interrupt(self, execution: BlockExecution) -> None:
        """``MC_GroupInterrupt``: stop on the path; the movements stay busy."""
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
        """``MC_GroupContinue``: continue what was interrupted, each with its own tool."""
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
        """Refuse in Disabled and ErrorStop; a present stop overrules (documented)."""
        self._require_enabled()
        if self.state is SmcGroupState.STOPPING:
            raise Overruled


class ToolBlocks(GroupCore):
    """Setting and reading the tool, exchanging the kinematics, reading the position."""

    @block
    def set_tool(
        self, execution: BlockExecution, tool: CoordRef, name: str = "ToolInForce"
    ) -> None:
        """``SMC_GroupSetTool``: applies to movements commanded from now on.

        Refused in Disabled and ErrorStop, and when the kinematics cannot honour the shift;
        the selected tool then stays (documented). The rotation never matters.
        """
        self._require_tool_change()
        self._require_fit(tool)
        self.tool = ToolInForce(tool.frame(), name)
        execution.finish()

    def read_tool(self, mode: ReadToolMode = ReadToolMode.SET) -> ToolInForce:
        """``SMC_GroupReadTool``, in any state.

        Raises:
            Refused: There is no such movement.
        """
        queue = self.motion.queue
        match mode:
            case ReadToolMode.SET:
                return self.tool
            case ReadToolMode.ACTIVE_MOVEMENT:
                movement = queue.active
            case ReadToolMode.LAST_COMMANDED:
                movement = queue.last
                unfinished = self.options.last_commanded_tool == "unfinished"
                if unfinished and movement is not None and movement.execution.ended:
                    movement = None
        if movement is None:
            raise BlockRefused(ErrorKind.NO_SUCH_MOVEMENT, "There is no such movement")
        return movement.tool

    @block
    def set_kin_transform(self, execution: BlockExecution, kinematics: KinematicsModel) -> None:
        """``MC_SetKinTransform``: removes the tool, even with the same kinematics (documented).

        Accepted in Disabled and Standby (assumed) for a kinematics that the drives fit;
        interrupted movements end, since their way was another kinematics's (assumed).
        """
        if self.state not in (SmcGroupState.DISABLED, SmcGroupState.STANDBY):
            raise BlockRefused(ErrorKind.WRONG_STATE, f"In {self.state.name}")
        kinds = tuple(axis.kind for axis in self.drives[: len(kinematics.kinds)])
        if kinds != kinematics.kinds:
            raise BlockRefused(ErrorKind.AXES_MISMATCH, f"The drives do not fit {kinematics.name}")
        self.motion.abandon_interrupted()
        self.kinematics = kinematics
        self.tool = ToolInForce()
        execution.finish()

    @block
    def set_coordinate_transform(
        self, execution: BlockExecution, system: CoordSystem, in_wcs: CoordRef
    ) -> None:
        """``MC_SetCoordinateTransform``: where MCS, PCS_1 or PCS_2 stands in WCS."""
        if self.options.coordinate_transform_in_use == "refused":
            self._require_unused(system)
        self.transforms.place(system, in_wcs.frame())
        execution.finish()

    def read_actual_position(self, system: CoordSystem = CoordSystem.MCS) -> ActualPosition:
        """``MC_GroupReadActualPosition`` of the TCP of the tool that is set.

        It therefore jumps when a tool is set (inferred, docs/reference/softmotion.md 1.1).
        """
        if system is CoordSystem.ACS:
            return ActualPosition(self.values, None)
        tcp = self.tcp()
        seen = self.transforms.in_mcs(system, tcp).inverse() @ tcp
        configuration = self.kinematics.configuration(self.values)
        return ActualPosition(CoordRef.of(seen).components(), configuration)

    def convert_position(
        self,
        position: Position,
        system_in: CoordSystem,
        system_out: CoordSystem,
        *,
        tool: CoordRef | None = None,
        near: AxisValues | None = None,
        configuration: Configuration = ANY_CONFIGURATION,
    ) -> Position:
        """``SMC_GroupConvertPosition``: the same place of the TCP in another coordinate system.

        Documented: by the tool that is set, not by that of the active movement, unless another
        is given (``UseToolOffsetParameter``, ``ToolOffset``). So a tool can be tried without
        being set; one that the kinematics cannot carry is refused as SMC_GroupSetTool does
        (assumed).

        Args:
            position: Axis values in ACS, else X, Y, Z in mm and A, B, C in degrees.
            system_in: What it counts in.
            system_out: What the answer counts in.
            tool: The tool to convert with.
            near: ``aRef``; where the axes are by default. Counts for ACS only.
            configuration: ``config``. Counts for ACS only.

        Raises:
            Refused: The position is none, or out of reach, or the tool does not fit.
        """
        if tool is not None:
            self._require_fit(tool)
        frame = self.tool.frame if tool is None else tool.frame()
        tcp_now = self.flange() @ frame
        planner = Planner(self.kinematics, self.axes, self.transforms)
        tcp = planner.tcp(self.values, Target(position, system_in), frame)
        if system_out is CoordSystem.ACS:
            reference = self.values if near is None else near
            return axes_for_tcp(self.kinematics, tcp, frame, configuration, near=reference)
        seen = self.transforms.in_mcs(system_out, tcp_now).inverse() @ tcp
        return CoordRef.of(seen).components()

    def continue_tool_offset(self) -> ToolInForce:
        """``SMC_GroupGetContinueToolOffset``: the tool that interrupted movements go on with.

        Raises:
            Refused: Nothing was interrupted.
        """
        if not self.motion.interrupted:
            raise BlockRefused(ErrorKind.NO_SUCH_MOVEMENT, "Nothing was interrupted")
        return self.motion.interrupted[0].tool

    def tcp(self) -> Frame:
        """Return where the TCP of the tool that is set is, in MCS."""
        return self.flange() @ self.tool.frame

    def _require_tool_change(self) -> None:
        locked = (SmcGroupState.DISABLED, SmcGroupState.ERROR_STOP)
        stopping = self.state is SmcGroupState.STOPPING and not self.options.set_tool_while_stopping
        if self.state in locked or stopping:
            raise BlockRefused(ErrorKind.WRONG_STATE, f"No tool can be set in {self.state.name}")

    def _require_unused(self, system: CoordSystem) -> None:
        """Refuse to move a PCS that something in progress uses (unverified where)."""
        jog = self.motion.jog
        under_way = [*self.motion.queue.unfinished, *self.motion.interrupted]
        systems = [*(it.system for it in under_way), *([jog.system] if jog else ())]
        if system in (CoordSystem.PCS_1, CoordSystem.PCS_2) and system in systems:
            raise BlockRefused(ErrorKind.PCS_STILL_IN_USE, f"{system.name} is still in use")

    def _require_fit(self, tool: CoordRef) -> None:
        image = self.kinematics.orientation_image(self.flange().rotation)
        if image is None:
            text = f"{self.kinematics.name} has no orientation image"
            raise BlockRefused(ErrorKind.NO_ORIENTATION_IMAGE, text)
        shift = tool.frame().shift_mm
        if not image.accepts(shift):
            raise BlockRefused(
                ErrorKind.TOOL_INCOMPATIBLE,
                f"{self.kinematics.name} cannot carry a tool shifted by {shift}",
            )


class AxisGroup(StateBlocks, MoveBlocks, ToolBlocks):
    """One axis group with its drives, and the signals beside it."""
