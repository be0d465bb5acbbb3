"""A recovery on a terminal: what is found, what is done, what is left."""

from robolink.messages import tr
from robolink.model import Controller, Finding
from robolink.transaction import Settler, recover
from robolink_cli._render import note, say
from robolink_cli._views import finding_payload


def recover_all(
    controller: Controller, *, keep: bool, take_over: str | None, dry_run: bool
) -> dict[str, object]:
    """Settle what reading the controller can settle; return the document of it.

    Args:
        controller: The controller, connected.
        keep: Whether new values that nobody verified stay.
        take_over: Why the lease of another is ended, ``None`` to leave it.
        dry_run: Whether it is only looked at.
    """
    if take_over is not None and not dry_run:
        controller.outcomes.take_over(take_over)
    if dry_run:
        return _looked_at(controller, keep=keep)
    done = recover(controller, keep=keep, tell=_tell)
    if not done.settled and not done.left:
        note(tr("Nothing is unsettled on this controller."))
    return {
        "settled": [finding_payload(finding) for finding in done.settled],
        "left": [finding_payload(finding) for finding in done.left],
        "selected_tool": controller.tools.selected(),
    }


def show_end(payload: dict[str, object]) -> None:
    """Say how it ended."""
    if payload.get("left"):
        say(tr("What is left takes a person: 'robolink resolve'."))
    elif payload.get("settled"):
        tool = payload.get("selected_tool")
        say(tr("Everything is settled; tool {tool} is in force.", tool=tool))


def _looked_at(controller: Controller, *, keep: bool) -> dict[str, object]:
    settler = Settler(controller, keep=keep)
    findings = [settler.examine(marker) for marker in controller.outcomes.open_markers()]
    for finding in findings:
        _show(finding)
    return {
        "settled": [],
        "left": [finding_payload(finding) for finding in findings],
        "selected_tool": controller.tools.selected(),
    }


def _tell(finding: Finding, settled: bool) -> None:
    _show(finding)
    if settled:
        note(tr("  done: {action}", action=finding.action) if finding.action else tr("  settled"))
    else:
        note(tr("  this takes a person: 'robolink resolve'"))


def _show(finding: Finding) -> None:
    note(f"{finding.marker.begun_at}  {finding.marker.request}\n  {finding.sentence}")
