"""The blocks about tool, kinematics and position (docs/reference/softmotion.md 1, 2.3)."""

from robolink_simulators.cell.frames import Frame
from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.condition import (
    ActualPosition,
    ReadToolMode,
    SmcGroupState,
)
from robolink_simulators.softmotion.group.core import GroupCore, block
from robolink_simulators.softmotion.kinematics.coordinates import CoordRef, CoordSystem
from robolink_simulators.softmotion.kinematics.kinematics import (
    ANY_CONFIGURATION,
    AxisValues,
    Configuration,
    KinematicsModel,
)
from robolink_simulators.softmotion.motion.movement import ToolInForce
from robolink_simulators.softmotion.motion.paths import axes_for_tcp
from robolink_simulators.softmotion.motion.planner import Planner, Position, Target
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind


class ToolBlocks(GroupCore):
    """Setting and reading the tool, exchanging the kinematics, reading the position."""

    @block
    def set_tool(
        self, execution: BlockExecution, tool: CoordRef, name: str = "ToolInForce"
    ) -> None:
        """``SMC_GroupSetTool``: counts for movements commanded from now on.

        Refused in Disabled and ErrorStop, and when the kinematics cannot honour the shift;
        the tool in force then stays (documented). The rotation never matters.
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
        """``MC_SetKinTransform``: takes the tool off, even with the same kinematics (documented).

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
        """Refuse to move a PCS in which something under way counts (unverified where)."""
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
