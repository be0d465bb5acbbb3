"""What stands on a controller, in the sentences with which a failed change ends."""

from robolink.messages import joined, tr
from robolink.model._tools import ToolOffset, describe_offset
from robolink.standing import Components, Standing, ToolStanding


def describe_standing(standing: Standing, *, settles: bool = True) -> str:
    """Return what moved, what was written, which tool is selected, and what settles the rest.

    It claims nothing that was not looked at.

    Args:
        standing: What stands.
        settles: Whether to say which command settles it; not where that is said besides.
    """
    parts = [_movement(standing), *_writes(standing), _selection(standing)]
    if not settles:
        return joined(" ", parts)
    if standing.left_open and standing.reset_first:
        parts.append(tr("Next: robolink robot reset, then robolink recover."))
    elif standing.left_open:
        parts.append(tr("Next: robolink recover."))
    return joined(" ", parts)


def _movement(standing: Standing) -> str:
    if standing.moving:
        return tr(
            "The robot may still be moving; the end of this was not seen: {requests}.",
            requests=", ".join(standing.moving),
        )
    if standing.moved:
        return tr("Every movement has ended.")
    return tr("Nothing was moved.")


def _writes(standing: Standing) -> list[str]:
    if not (standing.tools or standing.carried_out or standing.doubtful):
        return [tr("Nothing was written.")]
    parts = [_tool(number, tool) for number, tool in sorted(standing.tools.items())]
    if standing.carried_out:
        parts.append(
            tr("This was carried out: {requests}.", requests=", ".join(standing.carried_out))
        )
    if standing.doubtful:
        parts.append(
            tr(
                "This may or may not have been carried out: {requests}.",
                requests=", ".join(standing.doubtful),
            )
        )
    return parts


def _tool(number: int, tool: ToolStanding) -> str:
    before, holds = _shown(tool.before), _shown(tool.holds)
    if not tool.known:
        return tr(
            "Tool {tool} may hold the new value {requested}; before, it held {before}.",
            tool=number,
            requested=_shown(tool.requested),
            before=before,
        )
    if tool.differs:
        return tr(
            "Tool {tool} now holds {holds}; before, it held {before}.",
            tool=number,
            holds=holds,
            before=before,
        )
    return tr("Tool {tool} holds {holds}, as before.", tool=number, holds=holds)


def _selection(standing: Standing) -> str:
    if not standing.selection_known:
        return tr("It is not proved which tool is selected now.")
    if standing.selected is None:
        return tr("It was not read which tool is selected.")
    if standing.selected_another:
        return tr(
            "Tool {now} is selected now; it was tool {tool} before.",
            now=standing.selected,
            tool=standing.selected_before,
        )
    return tr("Tool {tool} is selected.", tool=standing.selected)


def _shown(components: Components) -> str:
    return describe_offset(None if components is None else ToolOffset(*components))
