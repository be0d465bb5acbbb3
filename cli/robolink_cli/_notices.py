"""What a person must know about something that was begun and not proved finished."""

from typing import TYPE_CHECKING

from robolink.messages import tr
from robolink_cli._render import note

if TYPE_CHECKING:
    from robolink.model import Controller, Marker, ToolOffset


def marker_notice(marker: "Marker", url: str) -> str:
    """Return the sentences about an unsettled marker, and the command that settles it."""
    from robolink.model import MarkerKind

    if marker.kind is MarkerKind.SELECTION:
        return _unfinished(marker, url)
    if marker.kind is MarkerKind.CHANGE:
        return tr(
            "Not finished since {when}: {request}.\n  'robolink -c {url} recover' settles it.",
            when=marker.begun_at,
            request=marker.request,
            url=url,
        )
    return tr(
        "Sent {when} and never answered: {request}. It may or may not have run, so motion is "
        "blocked.\n  'robolink -c {url} recover' settles what reading can, 'resolve' the rest.",
        when=marker.begun_at,
        request=marker.request,
        url=url,
    )


def note_change(controller: "Controller", tool: int, now: "ToolOffset | None") -> None:
    """Say when a tool does not hold what was last proved to be in it, and the usual causes."""
    from robolink.transaction import changed_since

    change = changed_since(controller, tool, now)
    if change is not None:
        note(change.sentence)


def _unfinished(marker: "Marker", url: str) -> str:
    now, before = marker.details.get("now", "?"), marker.details.get("tool", "?")
    parts = [
        tr("Not finished since {when}: {request}.", when=marker.begun_at, request=marker.request)
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
    remedy = tr(
        "'robolink -c {url} recover' puts tool {tool} back, with the power mode and speed of then.",
        url=url,
        tool=before,
    )
    return f"{' '.join(parts)}\n  {remedy}"
