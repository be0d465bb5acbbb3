"""Measures by a sensor where tips are, and compares that with the stored values."""

from robolink.calibration_run import RecipeRun
from robolink.errors import CalibrationError
from robolink.inspection._findings import InspectionCode, InspectionFinding
from robolink.messages import tr


def measured_findings(run: RecipeRun) -> tuple[InspectionFinding, ...]:
    """Return which tips are not where their stored values put them.

    A tip counts as moved from the limit on that the turn test of the recipe has.

    Args:
        run: A run that only measures, after its preflight and after a person's yes.

    Raises:
        RobolinkError: The robot could not finish; nothing was written.
    """
    try:
        report = run.run()
    except CalibrationError as error:
        return (
            InspectionFinding(
                InspectionCode.TIP_NOT_MEASURED,
                "",
                tr("The measurement was refused: {what}", what=error.what),
                error.remedy,
            ),
        )
    limits = {plan.tool: plan.criteria.drift_tolerance_mm for plan in run.plan.tools}
    return tuple(
        InspectionFinding(
            InspectionCode.TIP_MOVED,
            str(one.proposal.tool),
            tr(
                "Tool {tool}: the tip is {found:.3f} mm from where its value puts it, limit "
                "{limit:.3f} mm.",
                tool=one.proposal.tool,
                found=one.proposal.change_mm,
                limit=limits[one.proposal.tool],
            ),
            tr("Is the needle straight and tight? Then measure it again: robolink change"),
        )
        for one in report.tools
        if (one.proposal.change_mm or 0.0) > limits[one.proposal.tool]
    )
