"""What a person must know about interrupted jobs."""

from contextlib import suppress
from typing import TYPE_CHECKING

from robolink.messages import tr
from robolink.timing import local_label
from robolink_cli.console.exit_codes import recover_after
from robolink_cli.console.render import note

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robolink.model import Controller, Marker, OutcomeLog, ToolOffset


def note_unsettled(controller: "Controller", markers: "Sequence[Marker]", url: str) -> None:
    """Show the interrupted jobs, and what to do about each.

    Args:
        controller: The controller, connected; the link may be gone.
        markers: What to tell of.
        url: How a person names the controller.
    """
    from robolink.model import MarkerKind

    if not markers or note_at_work(controller.outcomes, url):
        return
    back = way_back(url, reset_first=_needs_reset(controller))
    for marker in markers:
        if marker.kind is MarkerKind.SELECTION:
            note(_unfinished(marker, back, _selected_now(controller, marker)))
        else:
            note(_notice(marker, url, back))


def way_back(url: str, *, reset_first: bool) -> str:
    """Return the commands that recover what was left open, in the order that works.

    Args:
        url: How a person names the controller.
        reset_first: Whether it needs a reset.
    """
    return recover_after(f'robolink -c "{url}"', again=False, reset_first=reset_first)


def _needs_reset(controller: "Controller") -> bool:
    """Return whether a reset comes first: as read now, or else as last seen."""
    from robolink.errors import RobolinkError

    with suppress(RobolinkError):
        return controller.status().needs_reset
    return controller.ledger.outcome().reset_first


def note_at_work(outcomes: "OutcomeLog", url: str) -> bool:
    """Show who else has the controller locked; return whether anybody has.

    What is open then is not left behind: whoever began it puts it back himself.
    """
    from robolink.errors import JournalError

    working = ""
    with suppress(JournalError):
        working = outcomes.at_work()
    if working:
        what = tr(
            "It finishes its own job; there is nothing to recover. Wait for it, or stop "
            "it: robolink -c {url} stop",
            url=url,
        )
        note(f"{working}\n  {what}")
    return bool(working)


def marker_notice(marker: "Marker", url: str) -> str:
    """Return the sentences about an open marker, and the command that recovers it."""
    from robolink.model import MarkerKind

    back = way_back(url, reset_first=False)
    if marker.kind is MarkerKind.SELECTION:
        return _unfinished(marker, back, str(marker.details.get("now", "?")))
    return _notice(marker, url, back)


def _notice(marker: "Marker", url: str, back: str) -> str:
    from robolink.model import MarkerKind, begun_in_words

    if marker.kind is MarkerKind.HISTORY:
        return _record_missing(marker, url)
    if marker.kind is MarkerKind.CHANGE:
        return tr(
            "Not finished since {when}: {request}.\n  Next: {commands}",
            when=local_label(marker.begun_at),
            request=begun_in_words(marker),
            commands=back,
        )
    return tr(
        "Sent {when} without a clear answer: {request}. It may or may not have run, so the "
        "robot stays blocked.\n  Next: {commands}",
        when=local_label(marker.begun_at),
        request=begun_in_words(marker),
        commands=back,
    )


def _record_missing(marker: "Marker", url: str) -> str:
    details = marker.details
    journal, before = str(details.get("journal", "")), str(details.get("before", ""))
    said = tr(
        "This computer changed this controller before, but the journal {journal} has no "
        "record of it: interrupted jobs are not shown.",
        journal=journal,
    )
    if before and before != journal:
        said += " " + tr("Its record was kept in {before}.", before=before)
    remedy = tr(
        "First check the selected tool and the tool values. Then run 'robolink -c {url} "
        "recover': it asks you and starts a new record.",
        url=url,
    )
    return f"{said}\n  {remedy}"


def note_change(controller: "Controller", tool: int, now: "ToolOffset | None") -> None:
    """Show when a tool does not hold its last confirmed value, and the usual causes."""
    from robolink.errors import JournalError
    from robolink.transaction import changed_since

    # Problems of the journal are shown once, at the end of the command.
    with suppress(JournalError):
        change = changed_since(controller, tool, now)
        if change is not None:
            note(change.sentence)


def _selected_now(controller: "Controller", marker: "Marker") -> str:
    """Return which tool is selected: as read, or else as far as the markers know it."""
    from robolink.errors import RobolinkError

    try:
        return str(controller.tools.selected())
    except RobolinkError:
        # A selection that was sent but not confirmed: it may be that tool, or still the one
        # before.
        now = str(marker.details.get("now", "?"))
        for other in controller.outcomes.open_markers():
            asked = str(other.details.get("select", now))
            if asked != now:
                return tr("{asked} or {now}", asked=asked, now=now)
        return now


def _unfinished(marker: "Marker", back: str, now: str) -> str:
    from robolink.model import begun_in_words

    before = str(marker.details.get("tool", "?"))
    parts = [
        tr(
            "Not finished since {when}: {request}.",
            when=local_label(marker.begun_at),
            request=begun_in_words(marker),
        )
    ]
    if now == before:
        parts.append(tr("Tool {tool} is selected, as before.", tool=now))
    else:
        parts.append(
            tr(
                "Tool {now} is selected now; it was tool {tool} before.",
                now=now,
                tool=before,
            )
        )
    if now == before:
        remedy = tr("Next: {command}", command=back)
    else:
        remedy = tr(
            "This restores tool {tool}, with the earlier power mode and speed: {commands}",
            commands=back,
            tool=before,
        )
    return f"{' '.join(parts)}\n  {remedy}"
