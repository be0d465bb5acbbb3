"""What stands on the controller when a command ended early: as a sentence, and as JSON."""

from typing import Final

from robolink.standing import UNTOUCHED, Components, Standing
from robolink_cli.console.output import show

_NAMES: Final = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")


def tell_standing(standing: Standing) -> None:
    """Say on stderr what stands; nothing of a command that had no controller, or only looked."""
    if standing is not UNTOUCHED:
        from robolink.model import describe_standing  # here, because --help needs none

        show(describe_standing(standing), beside=True)


def standing_payload(standing: Standing) -> dict[str, object]:
    """Return what stands, as plain JSON with units in the keys.

    What a tool holds is ``null`` where it is undefined, and where ``known`` is false.
    """
    return {
        "tools": {
            str(number): {
                "before": _named(tool.before),
                "requested": _named(tool.requested),
                "holds": _named(tool.holds) if tool.known else None,
                "known": tool.known,
            }
            for number, tool in standing.tools.items()
        },
        "selected_tool": standing.selected if standing.selection_known else None,
        "selected_before": standing.selected_before,
        "carried_out": list(standing.carried_out),
        "doubtful": list(standing.doubtful),
        "moving": list(standing.moving),
        "settled": standing.settled,
        "left_open": standing.left_open,
    }


def _named(components: Components) -> dict[str, float] | None:
    return None if components is None else dict(zip(_NAMES, components, strict=True))
