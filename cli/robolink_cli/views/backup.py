"""What backup and compare show."""

from pathlib import Path

from robolink.backup import Backup, Comparison, ComparisonTolerance, ToolComparison
from robolink.messages import tr
from robolink.model import json_fields, json_value
from robolink_cli.console.render import say, table
from robolink_cli.views.documents import number


def backup_payload(backup: Backup, file: Path) -> dict[str, object]:
    """Return what was saved."""
    tools = backup.state.tools
    return {
        "file": str(file),
        **json_fields(backup, "controller", "saved_at", "facts"),
        "selected_tool": backup.state.selected,
        "tools": {str(tool): json_value(offset) for tool, offset in tools.items()},
    }


def show_backup(backup: Backup, file: Path) -> None:
    """Say what was saved, and of which controller."""
    facts, tools = backup.facts, backup.state.tools
    unknown = tr("unknown")
    say(
        tr(
            "{url}: robot {models}, serial {serials}, firmware {firmware}",
            url=backup.controller,
            models=", ".join(facts.robot_models) or unknown,
            serials=", ".join(facts.robot_serials) or unknown,
            firmware=facts.firmware or unknown,
        )
    )
    say(
        tr(
            "Saved in {file}: {defined} of {count} tools are defined.",
            file=file,
            defined=sum(offset is not None for offset in tools.values()),
            count=len(tools),
        )
    )
    if backup.state.selected is not None:
        say(tr("Tool {tool} is selected.", tool=backup.state.selected))


def comparison_payload(comparison: Comparison, tolerance: ComparisonTolerance) -> dict[str, object]:
    """Return every tool that differs, with all its components."""
    return {
        "equal": comparison.equal,
        "tolerance_mm": tolerance.length_mm,
        "tolerance_deg": tolerance.angle_deg,
        "selected_tool": json_fields(
            comparison,
            expected="expected_selected",
            found="found_selected",
            equal="same_selection",
            counts="selection_counts",
        ),
        "differing": [_tool_payload(tool) for tool in comparison.differing],
    }


def show_comparison(comparison: Comparison, tolerance: ComparisonTolerance, identity: str) -> None:
    """Print a row for each component of each tool that differs."""
    rows = [row for tool in comparison.differing for row in _rows(tool)]
    if rows:
        columns = (
            tr("tool"),
            "",
            tr("file"),
            tr("controller"),
            tr("difference"),
            tr("allowed"),
            "",
        )
        table(identity, columns, rows)
    if not comparison.same_selection:
        say(
            tr(
                "  selected tool: {expected} in the file, {found} on the controller",
                expected=comparison.expected_selected,
                found=comparison.found_selected,
            )
        )
    if comparison.equal:
        say(
            tr(
                "Equal: all tools of {url} are as in the file, within {mm:g} mm and {deg:g} deg.",
                url=identity,
                mm=tolerance.length_mm,
                deg=tolerance.angle_deg,
            )
        )
    elif rows:
        numbers = ", ".join(str(tool.tool) for tool in comparison.differing)
        say(tr("Different tools: {numbers}.", numbers=numbers))


def _tool_payload(tool: ToolComparison) -> dict[str, object]:
    parts = [json_fields(part) | {"equal": part.equal} for part in tool.components]
    return {**json_fields(tool, "tool", "expected", "found"), "components": parts}


def _rows(tool: ToolComparison) -> list[list[object]]:
    if not tool.components:
        defined, undefined = tr("defined"), tr("undefined")
        sides = (tool.expected, tool.found)
        return [[tool.tool, "", *(undefined if s is None else defined for s in sides), "", "", "<"]]
    return [
        [
            tool.tool,
            part.name.replace("_", " ").upper().replace("MM", "mm").replace("DEG", "deg"),
            number(part.expected),
            number(part.found),
            f"{part.delta:+.3f}",
            f"{part.tolerance:g}",
            "" if part.equal else "<",
        ]
        for part in tool.components
        if part.expected or part.found or not part.name.startswith(("v", "w"))
    ]
