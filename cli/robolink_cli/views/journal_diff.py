"""What differs between two entries of the journal, or two changes."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Final, TypeAlias

from robolink.calibration import stated_mm
from robolink.messages import tr
from robolink.model import Recorded, ToolOffset, angle_difference_deg, with_method_name_now
from robolink.transaction import id_of_change
from robolink_cli.console.render import say, table
from robolink_cli.views.journal import (
    AFTER,
    AXES,
    COMPONENTS,
    SHORT,
    figure,
    first_offset,
    offset_cells,
    offset_payload,
    pose_rows,
)

_LENGTHS: Final = 3
"""How many of the components are lengths; the others are angles."""


_Offsets: TypeAlias = dict[str, ToolOffset | None]
"""What a tool held 'before' and 'after', as far as it is on record."""


class _Side:
    """One of the two, put together from its entries in the order in which they were stored."""

    def __init__(self, entries: Sequence[Recorded]) -> None:
        first = entries[0]
        numbers = [entry.number for entry in entries]
        self.name = (
            tr("entry {number}", number=first.number)
            if len(entries) == 1
            else tr("change {change}", change=id_of_change(first)[:SHORT])
        )
        self.numbers = numbers
        self.values: dict[int, _Offsets] = {}
        self.poses: list[object] = []
        self.facts: dict[str, str] = {"at": first.at, "controller": first.controller}
        for entry in entries:
            self._add(entry)

    def _add(self, entry: Recorded) -> None:
        if entry.tool is not None:
            for key, names in (("before", ("before",)), ("after", AFTER)):
                known, offset = first_offset(entry.details, names)
                if known:
                    offsets = self.values.setdefault(entry.tool, {})
                    # The oldest says what was there, the newest what it came to.
                    offsets[key] = offsets.get("before", offset) if key == "before" else offset
        poses = entry.details.get("poses")
        if isinstance(poses, list) and poses:
            self.poses = poses
        said = {"kind": str(entry.kind), "tolerance": entry.tolerance, "verdict": entry.verdict}
        method = with_method_name_now(entry.details).get("method")
        said |= {"method": str(method)} if method else {}
        for name in ("repeatable_to_mm", "accurate_to_mm"):
            value = entry.details.get(name)
            if isinstance(value, (int, float)):
                said[name] = stated_mm(value)
        self.facts |= {name: value for name, value in said.items() if value}
        self.facts |= {name: value for name, value in asdict(entry.signature).items() if value}


def diff_payload(a: Sequence[Recorded], b: Sequence[Recorded]) -> dict[str, object]:
    """Return the document of a comparison: B less A, lengths in mm, angles in degrees."""
    sides = _Side(a), _Side(b)
    tools = [
        {
            "tool": {"a": numbers[0], "b": numbers[1]},
            **{
                key: {
                    "a": offset_payload(first),
                    "b": offset_payload(second),
                    "difference": _difference(first, second),
                }
                for key, first, second in _offsets(values)
            },
        }
        for numbers, values in _pairs(*sides)
    ]
    return {
        "a": {"name": sides[0].name, "entries": sides[0].numbers},
        "b": {"name": sides[1].name, "entries": sides[1].numbers},
        "tools": tools,
        "fields": [{"name": n, "a": x, "b": y} for n, x, y in _different_facts(*sides)],
        "poses": {"a": sides[0].poses, "b": sides[1].poses},
    }


def show_diff(a: Sequence[Recorded], b: Sequence[Recorded]) -> None:
    """Print the comparison."""
    one, other = _Side(a), _Side(b)
    pairs = list(_pairs(one, other))
    for numbers, values in pairs:
        _show_tools(one, other, numbers, values)
    compared = {tool for numbers, _ in pairs for tool in numbers}
    left_out = sorted({*one.values, *other.values} - compared)
    if left_out:
        numbers_left = ", ".join(str(tool) for tool in left_out)
        say(tr("  on one side only: tool {numbers}", numbers=numbers_left))
    if one.poses != other.poses:
        rows = [[side.name, *row] for side in (one, other) for row in pose_rows(side.poses)]
        table(tr("poses of the flange"), ("", "", *AXES, tr("hand")), rows)
    facts = list(_different_facts(one, other))
    if facts:
        table(tr("what else differs"), ("", one.name, other.name), facts)


def _show_tools(
    one: _Side, other: _Side, numbers: tuple[int, int], values: tuple[_Offsets, _Offsets]
) -> None:
    rows = []
    for key, first, second in _offsets(values):
        said = tr("before") if key == "before" else tr("after")
        rows.append([said, one.name, *offset_cells(first)])
        rows.append([said, other.name, *offset_cells(second)])
        difference = _difference(first, second)
        if difference is not None:
            rows.append([said, tr("difference"), *map(figure, difference.values())])
    title = tr("tool {tool}", tool=numbers[0])
    if numbers[0] != numbers[1]:
        title = tr("tool {tool} and tool {other}", tool=numbers[0], other=numbers[1])
    table(title, ("", "", *AXES), rows)


def _pairs(one: _Side, other: _Side) -> Iterator[tuple[tuple[int, int], tuple[_Offsets, _Offsets]]]:
    """Yield the tools that are compared: those of the same number, or the only one of each."""
    if len(one.values) == len(other.values) == 1:
        (tool,), (other_tool,) = one.values, other.values
        yield (tool, other_tool), (one.values[tool], other.values[other_tool])
        return
    for tool in sorted(one.values.keys() & other.values.keys()):
        yield (tool, tool), (one.values[tool], other.values[tool])


def _offsets(
    values: tuple[_Offsets, _Offsets],
) -> Iterator[tuple[str, ToolOffset | None, ToolOffset | None]]:
    first, second = values
    for key in ("before", "after"):
        if key in first and key in second:
            yield key, first[key], second[key]


def _difference(a: ToolOffset | None, b: ToolOffset | None) -> dict[str, float] | None:
    if a is None or b is None:
        return None
    pairs = zip(b.components(), a.components(), strict=True)
    values = [
        new - old if place < _LENGTHS else angle_difference_deg(new, old)
        for place, (new, old) in enumerate(pairs)
    ]
    return dict(zip(COMPONENTS, values, strict=True))


def _different_facts(one: _Side, other: _Side) -> Iterator[tuple[str, str, str]]:
    for name in {**one.facts, **other.facts}:
        a, b = one.facts.get(name, ""), other.facts.get(name, "")
        if a != b:
            yield name, a, b
