"""Going through the open markers of a controller, one by one."""

from robolink.errors import OutcomeUnknownError, RobolinkError
from robolink.messages import tr
from robolink.model import Controller, Finding, MarkerKind
from robolink.transaction import Settler
from robolink_cli._consent import agree
from robolink_cli._render import note
from robolink_cli._views import finding_payload


def resolve_all(
    controller: Controller, *, dry_run: bool, yes: bool, forget: bool
) -> dict[str, object]:
    """Settle every open marker a person agrees to, and return what was found.

    The cell's own tool is put back last, when nothing else is in doubt.

    Raises:
        DeclinedError: A person left one open.
    """
    markers = sorted(
        controller.outcomes.open_markers(), key=lambda m: m.kind is MarkerKind.SELECTION
    )
    if not markers:
        note(tr("Nothing is unsettled on this controller."))
    settler = Settler(controller)
    if forget:
        agree(tr("Forget {count} open entries without looking?", count=len(markers)), yes=yes)
        if not dry_run:
            for marker in markers:
                settler.forget(marker)
        return {"findings": [], "forgotten": len(markers), "settled": not dry_run}
    findings = []
    for marker in markers:
        finding = settler.examine(marker)
        findings.append(finding)
        note(f"{marker.begun_at}  {marker.request}\n  {finding.sentence}")
        if not dry_run:
            _settle(settler, finding, yes=yes)
    return {
        "findings": [finding_payload(finding) for finding in findings],
        "forgotten": 0,
        "settled": not dry_run,
    }


def _settle(settler: Settler, finding: Finding, *, yes: bool) -> None:
    if finding.action:
        question = tr("Do it: {action}?", action=finding.action)
    else:
        question = tr("Is that as it should be, and may work go on?")
    agree(question, yes=yes)
    try:
        settler.settle(finding)
    except RobolinkError as error:
        if isinstance(error, OutcomeUnknownError):
            raise
        error.remedy = " ".join((error.remedy, tr("The entry stays open."))).strip()
        raise
