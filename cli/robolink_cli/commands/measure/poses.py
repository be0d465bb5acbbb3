"""poses show: how robolink reads a file of poses. Nothing is connected."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink.messages import tr
from robolink.model import json_fields
from robolink_cli.console.render import emit, say, table
from robolink_cli.options.declaration import CliArgument
from robolink_cli.options.pose_source import reading_options
from robolink_cli.options.shared import json_option

if TYPE_CHECKING:
    from robolink.pose_tables import HowRead, PoseTable, ReadingChoices, TabledPose


@click.group()
def poses() -> None:
    """Show how robolink reads a file of poses."""


@poses.command("show", short_help="Show the poses in a file, and how robolink read them.")
@reading_options
@json_option
def show(*, file: Annotated[Path, CliArgument()], choices: "ReadingChoices") -> None:
    """Show the poses in FILE in mm and EPSON's angles, and how robolink read them.

    FILE may come from a robot of another maker, a spreadsheet or ROS; docs/poses.md lists them.
    If the file leaves something open, robolink asks and never guesses. Connects to no controller.
    """
    from robolink.pose_tables import read_poses

    found = read_poses(file, choices)
    emit("poses", _payload(found), lambda: _show_table(file, found))


def _payload(found: "PoseTable") -> dict[str, object]:
    how = found.how
    read_as: dict[str, object] = {
        "encoding": how.encoding,
        "format": how.layout,
        **json_fields(how, "length", "length_by"),
        "angle": how.angle or None,
        "rotation": how.rotation,
        "separator": how.separator or None,
        "decimal": how.decimal or None,
        **json_fields(how, "columns", "ignored", "skipped"),
    }
    poses = [_pose_payload(entry) for entry in found.entries]
    # All poses have the same fields, so a field that was lost from one is noticed.
    said = [key for key in _BESIDE if any(pose[key] is not None for pose in poses)]
    silent = [key for key in _BESIDE if key not in said]
    for pose in poses:
        for key in silent:
            del pose[key]
    return {"poses": poses, "read_as": read_as}


_BESIDE: Final = ("name", "number", "hand", "local", "tool")


def _pose_payload(entry: "TabledPose") -> dict[str, object]:
    """Return a pose with its units in the keys; ``None`` for what the file does not state."""
    from robolink.model import COMPONENTS

    pose = entry.pose
    return {
        **json_fields(pose, *COMPONENTS),
        "name": entry.name or None,
        "number": entry.number,
        "hand": pose.hand,
        "local": pose.local if "local" in entry.stated else None,
        "tool": pose.tool,
    }


def _show_table(file: Path, found: "PoseTable") -> None:
    rows = [
        [
            *(entry.number if entry.number is not None else place, entry.name),
            *(f"{round(value, 3) + 0.0:.3f}" for value in entry.pose.coordinates()),
            *_marks(entry),
        ]
        for place, entry in enumerate(found.entries, start=1)
    ]
    columns = (tr("no."), tr("name"), "X mm", "Y mm", "Z mm", "U deg", "V deg", "W deg")
    table(str(file), (*columns, tr("hand"), tr("local"), tr("tool")), rows)
    say("\n".join(_sentences(found.how, len(rows))))


def _marks(entry: "TabledPose") -> tuple[str, str, str]:
    pose = entry.pose
    local = str(pose.local) if "local" in entry.stated else ""
    return str(pose.hand or ""), local, "" if pose.tool is None else str(pose.tool)


def _sentences(how: "HowRead", count: int) -> list[str]:
    said = {
        "file": tr("the file says so"),
        "format": tr("by definition of its format"),
        "option": tr("as you said"),
        "default": tr("no rotation stated"),
    }
    lines = [
        tr(
            "{count} poses read. Layout: {layout}, {encoding}.",
            count=count,
            layout=how.layout,
            encoding=how.encoding,
        ),
        tr("Lengths were in {length} ({said}).", length=how.length, said=said[how.length_by]),
        tr("Rotation: {rotation} {angle}", rotation=how.rotation, angle=how.angle).rstrip(),
    ]
    if how.ignored:
        lines.append(tr("Not used: {names}.", names=", ".join(how.ignored)))
    if how.skipped:
        lines.append(tr("Left out, because they are not taught poses: {count}.", count=how.skipped))
    return lines
