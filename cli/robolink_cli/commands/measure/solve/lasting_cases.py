"""Cases of ``solve`` over time: lengths, stations, chains, studies and control charts."""

from itertools import product
from typing import Final, cast

from robolink import calibration as cal
from robolink.messages import tr
from robolink.model import json_fields
from robolink_cli.commands.measure.solve.case import Node, Payload, finite, unusable

_SHARED: Final = "previous_touch"
_AXES: Final = ("nozzle", "person", "repeat")


def length_change(node: Node) -> Payload:
    """Heights of the touches of two runs on one pin."""
    moved = node.optional("pin_moved", node.raw)
    if moved not in (None, True, False):
        raise unusable(node.at("pin_moved"), tr("expected: true or false"))
    found = node.call(
        cal.length_change, "before_z after_z stored_z v w sigma_z_mm", pin_moved=bool(moved)
    )
    decision = _decision(node)
    undecided = found.changed and decision is None
    payload: Payload = {
        "status": "error" if undecided else "warn" if found.changed else "ok",
        "codes": ["length_changed"] if found.changed else [],
        **json_fields(found, "height_change_mm", "u_mm", "limit_mm", "z_by_difference_mm"),
        "offset_z": None if undecided else found.z_mm(decision),
    }
    if undecided:
        payload |= {
            "what": tr(
                "The tip is {longer:+.3f} mm longer (+-{half}), and the case does not say "
                "what to write.",
                longer=found.longer_mm,
                half=cal.stated_mm(found.half95_mm),
            ),
            "remedy": tr("Decide: difference, keep, or measure."),
        }
    return payload


def station_shift(node: Node) -> Payload:
    """How far a station seems to have moved, tool by tool."""
    shifts = [_shift(child) for child in node.children("shifts")]
    if not shifts:
        raise unusable(node.at("shifts"), tr("expected: at least one shift"))
    found = node.call(cal.judge_shifts, "seat_changes", shifts=shifts)
    assert found is not None  # noqa: S101 - there are shifts
    tolerance_mm = node.optional("tolerance_mm", node.number)
    payload: Payload = {
        "codes": [],
        "common_mm": list(found.vector_mm),
        "u_mm": list(found.sigma_mm),
        **json_fields(found, "chi_square", "chi_square_limit", "detectable_mm"),
    }
    if found.moved:
        return payload | {
            "status": "error",
            "codes": ["station_moved"],
            "what": tr("The station moved by {distance:.3f} mm.", distance=found.distance_mm),
            "remedy": tr("Fasten it, find it again, then measure each tool there."),
        }
    if tolerance_mm is not None and found.undecided(tolerance_mm):
        payload["codes"] = ["station_undecided"]
    return payload


def needle_chain(node: Node) -> Payload:
    """Needle changes one after the other since a full calibration."""
    changes = node.whole("changes")
    if changes < 0:
        raise unusable(node.at("changes"), tr("expected: 0 or more"))
    # Anything but a shared touch counts as two touches per change, the larger uncertainty.
    shared = node.text("reference") == _SHARED
    u_mm = cal.chain_sigma_mm(
        node.number("u0_mm"), node.number("sigma_mm"), changes, shared_touch=shared
    )
    return {"u_mm": u_mm}


def station_chain(node: Node) -> Payload:
    """Tools that were each touched once at one station."""
    shared = node.call(cal.shared_station, "u_station_mm sigma_mm")
    return {
        "u_mm": [shared.u_mm] * len(node.numbers("tools")),
        **json_fields(shared, "correlation", "u_difference_mm"),
    }


def update_guard(node: Node) -> Payload:
    """A new offset against the stored one."""
    correction = node.call(cal.update_guard, "new stored earlier_mm max_change_mm")
    return {"correction_mm": correction.distance_mm, "ratio": correction.ratio}


def study_values(case: Node) -> list[list[list[float]]]:
    """Return the values of a case of a gauge study: nozzles, of persons, of repeats.

    Raises:
        CalibrationError: ``non_finite``.
        ConfigError: It is none.
    """
    case.ignore("schema", "id", "units", "note", "expected", "tolerance", "accuracy")
    case.text("method", "gauge_rr")
    node = case.child("input")
    case.finish()
    axes = node.optional("axes", lambda name: _axes(node, name)) or _AXES
    node.ignore("tolerance_mm")
    values = _table(node, axes)
    node.finish()
    return values


def gauge_rr(node: Node) -> Payload:
    """Nozzles seated and touched by several persons, several times each."""
    axes = node.optional("axes", lambda name: _axes(node, name)) or _AXES
    study = node.call(cal.gauge_study, "tolerance_mm", values_mm=_table(node, axes))
    return {
        "codes": list(study.warnings),
        **json_fields(study, "notes", "repeatability_mm", "reproducibility_mm", "grr_mm"),
        **json_fields(study, "part_mm", "interaction_p", "interaction_pooled"),
        **json_fields(study, "percent_of_tolerance", "percent_of_total", "ndc"),
        **json_fields(study, "repeatability_dof", "repeatability_limits_mm"),
        **json_fields(study, "reproducibility_limits_mm", "reproducibility_upper95_mm"),
    }


def control_chart(node: Node) -> Payload:
    """Later calibrations against the first ones."""
    chart = node.call(
        cal.control_chart,
        "baseline ewma_width",
        values_mm=node.optional("values", node.numbers) or (),
        weight=node.number_or("lambda", cal.USUAL_LAMBDA),
    )
    return {
        "codes": list(chart.warnings),
        **json_fields(chart, "notes", "centre", "sigma_mm", "limits", "points_out"),
        **json_fields(chart, "ewma", "ewma_first"),
    }


def _shift(node: Node) -> cal.TipShift:
    shift = node.made(cal.TipShift, "tool vector seat_sigma_mm touch_sigma_mm")
    seat, vector = shift.seat_sigma_mm, shift.vector_mm
    if len(vector) not in (1, 2, 3):
        raise unusable(node.at("vector"), tr("expected: one, two or three numbers"))
    if seat and len(seat) < len(vector):
        raise unusable(node.at("seat_sigma_mm"), tr("expected: one number for each axis"))
    cal.require_positive(shift.touch_sigma_mm, "touch_sigma_mm")
    return shift


def _decision(node: Node) -> "cal.LengthDecision | None":
    if node.optional("decision", node.raw) is None:
        return None
    return cast("cal.LengthDecision", node.text("decision", "difference", "keep", "measure"))


def _axes(node: Node, name: str) -> tuple[str, ...]:
    value = node.raw(name)
    if not isinstance(value, list) or sorted(map(str, value)) != sorted(_AXES):
        raise unusable(
            node.at(name),
            tr("expected: these three, in any order: {words}", words=", ".join(_AXES)),
        )
    return tuple(map(str, value))


def _table(node: Node, axes: tuple[str, ...]) -> list[list[list[float]]]:
    """Return the values by nozzle, person and repeat, whatever the order of the file."""
    path = node.at("values")
    table = [
        [
            [finite(value, f"{path}[{i}][{j}][{k}]") for k, value in enumerate(_list(inner, path))]
            for j, inner in enumerate(_list(outer, path))
        ]
        for i, outer in enumerate(_list(node.raw("values"), path))
    ]
    sizes = (
        {len(table)},
        {len(outer) for outer in table},
        {len(inner) for outer in table for inner in outer},
    )
    if axes == _AXES or any(len(size) != 1 for size in sizes):
        return table  # the solver names missing values
    place = [axes.index(axis) for axis in _AXES]
    n, o, r = (next(iter(sizes[at])) for at in place)
    found = [[[0.0] * r for _ in range(o)] for _ in range(n)]
    for index in product(range(n), range(o), range(r)):
        i, j, k = (index[place.index(at)] for at in range(3))
        found[index[0]][index[1]][index[2]] = table[i][j][k]
    return found


def _list(value: object, path: str) -> list[object]:
    if not isinstance(value, list):
        raise unusable(path, tr("expected: a list"))
    return value
