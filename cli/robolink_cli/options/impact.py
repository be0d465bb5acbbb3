"""How far taught points move: the options, the reading, the table."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import json_fields
from robolink_cli.access.capabilities import points_of
from robolink_cli.console.render import say, table
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.pose_source import point_numbers

if TYPE_CHECKING:
    from robolink.calibration import Impact
    from robolink.model import Controller, Pose, ToolOffset


@dataclass(frozen=True, slots=True)
class ImpactRequest:
    """The points to judge: numbers on the controller, or a ``.pts`` file."""

    numbers: tuple[int, ...] = ()
    path: Path | None = None

    def read(self, controller: "Controller") -> "dict[int, Pose | None]":
        """Return the points by number, ``None`` for one that is not taught."""
        if self.path is None:
            return dict(points_of(controller).read_all(self.numbers))
        from robolink.pose_tables import read_pts

        return read_pts(self.path)


ImpactPoints = Annotated[
    str | None,
    CliOption(
        metavar="1-50", help="Before the write, show how far the tip moves at these taught points."
    ),
]

ImpactFile = Annotated[
    Path | None, CliOption(help="Same, for all points of a .pts file of EPSON RC+.")
]


def impact_request(
    numbers: str | None, path: Path | None, *, names: tuple[str, str]
) -> ImpactRequest | None:
    """Return the requested points, ``None`` for none.

    Raises:
        ConfigError: Both forms were given.
    """
    if numbers and path is not None:
        raise ConfigError(
            tr("These cannot be combined: {names}.", names=", ".join(names)),
            remedy=tr("Read the points from the controller or from a file."),
        )
    if numbers:
        return ImpactRequest(point_numbers(numbers))
    return ImpactRequest(path=path) if path is not None else None


def judge(
    points: "dict[int, Pose | None] | None", *, old: "ToolOffset | None", new: "ToolOffset"
) -> "Impact | None":
    """Return the effect of the change at ``points``.

    ``None`` when no points were asked for, or when the tool was undefined: a program cannot
    have driven to them with it (docs/reference/epson.md 1.5).
    """
    from robolink.calibration import impact_on

    if points is None or old is None:
        return None
    return impact_on(points, old=old, new=new)


def impact_payload(impact: "Impact") -> dict[str, object]:
    """Return the document's part about the impact."""
    largest = impact.largest
    return {
        "points": [
            {
                "point": entry.number,
                **json_fields(entry.pose, "x_mm", "y_mm", "z_mm", "u_deg"),
                **json_fields(entry, "dx_mm", "dy_mm", "dz_mm", "turn_deg", "distance_mm"),
            }
            for entry in impact.entries
        ],
        "largest_mm": None if largest is None else largest.distance_mm,
        "largest_point": None if largest is None else largest.number,
        "undefined_count": len(impact.undefined),
        "other_local": [
            {"point": number, "local": local} for number, local in impact.other_local.items()
        ],
    }


def show_impact(tool: int, impact: "Impact") -> None:
    """Print where the tip will be at the taught points, against where it goes now."""
    columns = (tr("point"), "U deg", "dX mm", "dY mm", "dZ mm", tr("turn deg"), tr("distance mm"))
    rows = [
        [
            f"P{entry.number}",
            *map(_cell, (entry.pose.u_deg, entry.dx_mm, entry.dy_mm)),
            *map(_cell, (entry.dz_mm, entry.turn_deg, entry.distance_mm)),
        ]
        for entry in impact.entries
    ]
    if rows:
        table(
            tr("where the tip of tool {tool} will be, compared with now", tool=tool), columns, rows
        )
    if impact.alike and impact.largest is not None:
        say(
            tr(
                "  at every point: {distance:.3f} mm, if tool {tool} is used there",
                distance=impact.largest.distance_mm,
                tool=tool,
            )
        )
    elif impact.largest is not None:
        say(
            tr(
                "  largest: {distance:.3f} mm at P{point}, if tool {tool} is used there",
                distance=impact.largest.distance_mm,
                point=impact.largest.number,
                tool=tool,
            )
        )
    else:
        say(f"  {tr('No point could be judged.')}")
    _show_left_out(impact)


def _show_left_out(impact: "Impact") -> None:
    if impact.undefined:
        say(tr("  not taught, skipped: {count}", count=len(impact.undefined)))
    if impact.other_local:
        named = ", ".join(f"P{n} (local {local})" for n, local in impact.other_local.items())
        left_out = tr("In another local coordinate system, left out: {points}.", points=named)
        say(f"  {left_out}")


def _cell(value: float) -> str:
    # Adding zero removes the minus sign of values that round to zero.
    return f"{round(value, 3) + 0.0:.3f}"
