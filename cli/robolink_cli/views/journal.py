"""What the journal's commands show: payloads, and the tables made from them."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from typing import Final, TypeAlias

from robolink.calibration import stated_mm
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import (
    COMPONENTS,
    EntryKind,
    Recorded,
    ToolOffset,
    describe_offset,
    json_fields,
    json_value,
    read_offset,
    with_method_name_now,
)
from robolink.transaction import id_of_change
from robolink_cli.console.render import say, table
from robolink_cli.views.documents import AXES, offset_difference

SHORT: Final = 8
"""Number of characters of an id in a table."""

_VALUES: Final = ("before", "proposed", "requested", "value", "tip")
AFTER: Final = ("value", "proposed", "requested")
"""Keys of the details that may hold the tool's new or requested value."""

_PLAIN: Final = (
    *("number", "at", "controller", "kind", "change", "operation", "tool"),
    *("tolerance", "verdict"),
)
_LISTS: Final = ("poses", "drifts", "tools")
_IN_STATEMENTS: Final = (
    *("repeatable_to_mm", "accurate_to_mm", "accuracy", "budget", "seating", "judgement"),
)
"""Details that are left out, because sentences and a table already give them."""

_UNITS: Final = {
    "_mm_s": "mm/s",
    "_deg_s": "deg/s",
    "_mm": "mm",
    "_deg": "deg",
    "_percent": "%",
    "_ms": "ms",
    "_s": "s",
}
"""Units by the ending of a recorded name, longer endings first."""


def entry_payload(entry: Recorded, *, as_stored: bool = False) -> dict[str, object]:
    """Return an entry with its units in the keys.

    Args:
        entry: The entry.
        as_stored: Whether the details are wanted letter by letter, as the hash counts them; else
            they name the method as it is named now.
    """
    payload: dict[str, object] = json_fields(entry, *_PLAIN)
    for key, names in (("before", ("before",)), ("after", AFTER)):
        known, offset = first_offset(entry.details, names)
        if known:
            payload[key] = json_value(offset)
    payload["details"] = dict(entry.details) if as_stored else with_method_name_now(entry.details)
    return payload | asdict(entry.signature) | {"previous": entry.previous, "hash": entry.hash}


def first_offset(
    details: Mapping[str, object], names: Iterable[str]
) -> tuple[bool, ToolOffset | None]:
    """Return whether one of ``names`` is recorded, and the first that is."""
    for name in names:
        if name in details:
            try:
                return True, read_offset(details[name])
            except ConfigError:
                return False, None  # a damaged entry is shown all the same
    return False, None


def show_list(entries: Sequence[Recorded], *, all_controllers: bool) -> None:
    """Print entries as a table."""
    if not entries:
        say(tr("There is no such entry in the journal."))
        if not all_controllers:
            say(
                tr(
                    "The journal knows a controller by the addresses used so far. To add "
                    "one: robolink -c URL status"
                )
            )
        return
    columns = [tr("number"), tr("time (UTC)"), tr("change id"), tr("tool"), tr("kind")]
    columns += [tr("value or verdict"), tr("who")]
    if all_controllers:
        columns.insert(2, tr("controller"))
    rows = []
    for entry in entries:
        tool = "" if entry.tool is None else entry.tool
        row: list[object] = [entry.number, short_time(entry.at), id_of_change(entry)[:SHORT], tool]
        row += [entry.kind, said_in(entry), who(entry)]
        if all_controllers:
            row.insert(2, entry.controller)
        rows.append(row)
    table(tr("journal"), columns, rows)


def show_entry(entry: Recorded) -> None:
    """Print all fields of an entry."""
    shown: dict[str, object] = {
        tr("time (UTC)"): short_time(entry.at),
        tr("controller"): entry.controller,
        tr("kind"): entry.kind,
        tr("tool"): "" if entry.tool is None else entry.tool,
        tr("change id"): entry.change,
        tr("operation"): entry.operation,
        tr("allowed"): entry.tolerance,
        tr("verdict"): entry.verdict,
        **_signed(entry),
        tr("entry before"): entry.previous,
        tr("hash"): entry.hash,
    }
    say(tr("entry {number}", number=entry.number))
    for name, value in shown.items():
        if value != "":
            say(f"  {name}: {value}")
    said_first = _statements(entry)
    for sentence in said_first:
        say(f"  {sentence}")
    told = _IN_STATEMENTS if said_first else ()
    for name, value in with_method_name_now(entry.details).items():
        if name not in (*_VALUES, *_LISTS, *told):
            for row, said in detail_rows(name, value):
                say(f"  {row}: {said}")
    _show_values(entry)
    _show_accuracy(entry.details.get("accuracy"))
    _show_poses(entry.details.get("poses"))
    _show_drifts(entry.details.get("drifts"))
    say()


def _statements(entry: Recorded) -> list[str]:
    """Return a measurement's repeatability and accuracy; nothing for another entry."""
    if entry.kind not in (EntryKind.CALIBRATION, EntryKind.VERIFY):
        return []
    from robolink.calibration import (
        TurnJudgement,
        seating_sentence,
        statement_sentences,
        turn_test_sentences,
    )
    from robolink.report import recorded_fit

    details = with_method_name_now(entry.details)
    try:
        if entry.kind is EntryKind.VERIFY:
            judged = details.get("judgement")
            return list(turn_test_sentences(TurnJudgement.from_json(judged) if judged else None))
        said = list(statement_sentences(recorded_fit(details)))
        seating = details.get("seating")
        if said and seating:
            said.append(seating_sentence(seating["within_mm"], seating["changes"]))
    except (ConfigError, LookupError, TypeError, ValueError):
        return []  # a damaged entry is shown as it is
    return said


def _show_accuracy(found: object) -> None:
    from robolink.calibration import Accuracy
    from robolink_cli.views.fit import show_accuracy_rows

    with suppress(LookupError, TypeError, ValueError):
        if isinstance(found, Mapping):
            show_accuracy_rows(Accuracy.from_json(found))


def detail_rows(name: str, value: object) -> Iterator[tuple[str, str]]:
    """Yield the recorded ``name`` as rows: what it is, and its value with its unit.

    What has parts has a row for each, named after the whole: ``facts firmware``, ``rows 2 name``.
    What is empty has none.

    Args:
        name: As it is recorded, its unit at the end.
        value: Plain JSON.
    """
    if isinstance(value, Mapping):
        for key, part in value.items():
            yield from detail_rows(f"{name} {key}", part)
    elif isinstance(value, list) and any(isinstance(part, Mapping) for part in value):
        for number, part in enumerate(value, start=1):
            yield from detail_rows(f"{name} {number}", part)
    elif value not in (None, [], ""):
        end = next((end for end in _UNITS if name.endswith(end) and _is_figures(value)), "")
        said = _plain(value) + (f" {_UNITS[end]}" if end else "")
        yield name.removesuffix(end).replace("_", " "), said


def said_in(entry: Recorded) -> str:
    """Return the value or the verdict of an entry in one line."""
    if entry.kind in (EntryKind.READ_BACK, EntryKind.DONE, EntryKind.ROLLED_BACK):
        known, offset = first_offset(entry.details, ("value",))
        if known:
            verdict = f" ({entry.verdict})" if entry.verdict else ""
            return describe_offset(offset) + verdict
    if entry.kind is EntryKind.DECISION and "question" in entry.details:
        return f"{entry.details['question']} {entry.verdict}"
    return entry.verdict or str(entry.details.get("request", ""))


def who(entry: Recorded) -> str:
    """Return who did it: the person, or else the user of the computer."""
    signature = entry.signature
    role = f" ({signature.role})" if signature.role else ""
    return (signature.operator or signature.os_user) + role


def short_time(at: str) -> str:
    """Return a time label to the second."""
    return at[:19].replace("T", " ")


def pose_rows(poses: object) -> list[list[str]]:
    """Return recorded poses as rows of a table, without damaged ones."""
    if not isinstance(poses, list):
        return []
    rows = []
    for number, pose in enumerate(poses, start=1):
        if isinstance(pose, dict):
            cells = [figure(pose.get(name)) for name in COMPONENTS]
            rows.append([str(number), *cells, str(pose.get("hand", ""))])
    return rows


def _show_values(entry: Recorded) -> None:
    rows = []
    for name in _VALUES:
        known, offset = first_offset(entry.details, (name,))
        if known:
            rows.append([name, *offset_cells(offset)])
    if rows:
        table(tr("values"), ("", *AXES), rows)


def _show_poses(found: object) -> None:
    rows = pose_rows(found)
    if rows:
        table(tr("poses of the flange"), ("", *AXES, tr("hand")), rows)


def _show_drifts(found: object) -> None:
    drifts = found if isinstance(found, list) else []
    keys = ("u_deg", "dx_mm", "dy_mm", "dz_mm")
    rows = [[figure(drift.get(key)) for key in keys] for drift in drifts]
    if rows:
        table(tr("drift about the new tip"), ("U deg", "dX mm", "dY mm", "dZ mm"), rows)


def _signed(entry: Recorded) -> dict[str, object]:
    signature = entry.signature
    return {
        tr("operator"): signature.operator,
        tr("role"): signature.role,
        tr("user"): signature.os_user,
        tr("computer"): signature.host,
        tr("nozzle"): signature.nozzle,
        tr("lot"): signature.lot,
        tr("recipe"): signature.recipe,
        tr("recipe's SHA-256"): signature.recipe_hash,
        tr("station"): signature.station,
        tr("robolink"): signature.version,
    }


def offset_cells(offset: ToolOffset | None) -> list[str]:
    """Return six table cells for an offset."""
    if offset is None:
        return [tr("undefined"), *[""] * 5]
    return [figure(value) for value in offset.components()]


def figure(value: object) -> str:
    """Return a table cell for a length or an angle."""
    # Adding zero removes the minus sign of values that round to zero.
    return f"{round(value, 3) + 0.0:.3f}" if isinstance(value, (int, float)) else "-"


def _is_figures(value: object) -> bool:
    if isinstance(value, list):
        return all(map(_is_figures, value))
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))


def _plain(value: object) -> str:
    if isinstance(value, list):
        rows = any(isinstance(part, list) for part in value)
        return ("; " if rows else ", ").join(map(_plain, value))
    if isinstance(value, bool):
        return tr("yes") if value else tr("no")
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


_Offsets: TypeAlias = dict[str, ToolOffset | None]
"""Offsets of a tool 'before' and 'after', as far as they are recorded."""


class _Side:
    """One side of the comparison, from its entries in the order in which they were stored."""

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
                    # The oldest entry has the value before, the newest the value after.
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
                    "a": json_value(first),
                    "b": json_value(second),
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
        table(tr("other differences"), ("", one.name, other.name), facts)


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
    """Yield the tools to compare: those of the same number, or the only one of each."""
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
    return None if a is None or b is None else offset_difference(a, b)


def _different_facts(one: _Side, other: _Side) -> Iterator[tuple[str, str, str]]:
    for name in {**one.facts, **other.facts}:
        a, b = one.facts.get(name, ""), other.facts.get(name, "")
        if a != b:
            yield name, a, b
