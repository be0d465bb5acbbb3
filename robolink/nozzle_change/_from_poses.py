"""A nozzle change from poses that exist already: taught, typed or kept in a file.

With the guard open in Teach, where a person touches a tip to a pin, a PC commands nothing
(design part 1a). So the poses are taught on the pendant and read afterwards. Nothing moves
here and no tool is selected; therefore nothing is proved by turning about the new tip either.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from robolink.calibration import (
    CalibrationResult,
    ToolFit,
    better_fit,
    solve_two_pose,
    tool_fits,
    two_of,
)
from robolink.errors import CalibrationError, UndefinedToolError
from robolink.messages import tr
from robolink.model import Controller, Pose, ToolOffset
from robolink.nozzle_change._plan import ChangeReport, Proposal
from robolink.nozzle_change._preview import flange_pose


@dataclass(frozen=True, slots=True)
class PosesPlan:
    """What to find out from given poses.

    Attributes:
        tool: Number of the tool whose nozzle was changed.
        taught_tool: The tool whose tip the poses describe; 0 when they are flange poses.
        max_change_mm: Largest plausible change against the stored value, in the plane.
    """

    tool: int
    taught_tool: int = 0
    max_change_mm: float = 2.0


@dataclass(frozen=True, slots=True)
class PosesProposal:
    """What given poses say.

    Attributes:
        plan: What was asked for.
        proposal: The offset, next to what is stored.
        fits: Which tools the poses may have been taught with, the likeliest first.
        better: A tool that fits the poses much better than the one named, if there is one.
    """

    plan: PosesPlan
    proposal: Proposal
    fits: tuple[ToolFit, ...]
    better: ToolFit | None


def propose_from_poses(
    controller: Controller, plan: PosesPlan, poses: Sequence[Pose]
) -> PosesProposal:
    """Solve two poses on one point. Reads the tool table, moves and writes nothing.

    Args:
        controller: Holds the offsets.
        plan: What to find out.
        poses: Two poses, mm and degrees, of the tip of ``plan.taught_tool``.

    Raises:
        CalibrationError: The poses give no trustworthy result; its code says why.
        ConfigError: More than two poses.
        UndefinedToolError: ``plan.taught_tool`` has no definition.
    """
    first, second = two_of(poses)
    before = controller.tools.read(plan.tool)
    taught = _require_defined(controller, plan.taught_tool)
    result = solve_two_pose(flange_pose(first, taught), flange_pose(second, taught), stored=before)
    # The listing may lack V and W; what is compared and written comes from single reads.
    listed = {tool: o for tool, o in controller.tools.read_all().items() if o is not None}
    fits = tool_fits(result, taught=plan.taught_tool, stored=listed, calibrated=plan.tool)
    better = better_fit(fits, taught=plan.taught_tool, plausible_mm=plan.max_change_mm)
    if better is not None:
        result = _doubted(result)
    return PosesProposal(plan, Proposal(plan.tool, before, result), fits, better)


def require_plausible(proposed: PosesProposal) -> None:
    """Refuse a change that no nozzle change explains.

    Raises:
        CalibrationError: ``implausible_change``; the remedy names a tool that fits better.
    """
    if proposed.better is not None:
        remedy = tr(
            "The poses fit tool {better} much better than tool {taught}: if they were taught "
            "with it, give --taught-tool {better}.",
            better=proposed.better.tool,
            taught=proposed.plan.taught_tool,
        )
    else:
        remedy = tr(
            "Check that both poses touched the same point and with which tool they were taught "
            "(--taught-tool). If the change is real, allow it with --max-change."
        )
    proposed.proposal.require_plausible(proposed.plan.max_change_mm, remedy=remedy)


def write_proposal(controller: Controller, proposal: Proposal) -> ChangeReport:
    """Write the proposal if the stored value is still that of before, and read it back.

    Raises:
        ToolChangedError: The tool was changed meanwhile; nothing was written.
        RobolinkError: As :meth:`robolink.model.ToolTable.write`.
    """
    receipt = controller.tools.write(
        proposal.tool, proposal.result.offset, expected=proposal.before
    )
    return ChangeReport(proposal, receipt, verification=None)


def _require_defined(controller: Controller, tool: int) -> ToolOffset:
    offset = controller.tools.read(tool)
    if offset is None:
        raise UndefinedToolError(
            tr("Tool {tool} is not defined, so no pose was taught with it.", tool=tool),
            remedy=tr("Name the tool that was selected on the pendant with --taught-tool."),
            controller=controller.identity,
        )
    if offset.v_deg or offset.w_deg:
        raise CalibrationError(
            "tilted_pose",
            tr("Tool {tool} is tilted (V or W is not 0).", tool=tool),
            remedy=tr("Teach the poses with Tool 0."),
        )
    return offset


def _doubted(result: CalibrationResult) -> CalibrationResult:
    return replace(result, warnings=(*result.warnings, "other_tool_fits"))
