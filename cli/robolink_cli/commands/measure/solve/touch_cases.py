"""What ``solve`` takes of touches: how they were made, surfaces that were touched, and studies."""

from collections.abc import Callable, Mapping
from itertools import product
from typing import Final

from robolink import calibration as cal
from robolink.errors import CalibrationError
from robolink.messages import declared, spoken, tr
from robolink_cli.commands.measure.solve.case import Node, finite, read_pose, read_poses, unusable
from robolink_cli.views.solve import result_payload

Payload = dict[str, object]


def touch_evidence(node: Node) -> Payload:
    """Touches of one pin, with where the robot stopped before each."""
    touches = [_touch(child) for child in node.children("touches")]
    if not touches:
        raise _nothing_touched()
    evidence = cal.judge_touches(
        touches,
        resolution_mm=node.number_or("resolution_mm", 0.001),
        sigma_z_mm=node.number_or("sigma_z_mm", cal.PERSON_SIGMA_Z_MM),
    )
    payload: Payload = {
        "z_range_mm": evidence.z_range_mm,
        "z_limit_mm": evidence.z_limit_mm,
        "jog_mm": list(evidence.jog_mm),
        "gamma": evidence.gamma,
        "gamma_upper99": evidence.gamma_upper99,
        "not_touched": list(evidence.not_touched),
        "typed_ahead": list(evidence.typed_ahead),
        "max_residual": evidence.max_residual_mm,
    }
    seen = any(touch.arrival is not None or touch.contact for touch in touches)
    payload["notes"] = [] if seen else ["touches_not_witnessed"]
    return payload | _verdict(evidence.codes, refuses=True)


def verify_evidence(node: Node) -> Payload:
    """A proof: where the tip should have been, where the robot stopped, where the tip was found."""
    tolerance, u = node.number("tolerance_mm"), node.number_or("u_drift_mm", cal.PERSON_U_DRIFT_MM)
    resolution = node.number_or("resolution_mm", 0.001)
    if tolerance <= 0 or u < 0:
        raise unusable(node.path, tr("the tolerance is above 0, and u_drift_mm not below"))
    drifts, made = [], []
    for child in node.children("touches"):
        place, touch = read_pose(child.child("place")), _found(child)
        drifts.append(
            cal.Drift(
                place.u_deg,
                touch.captured.x_mm - place.x_mm,
                touch.captured.y_mm - place.y_mm,
                u_mm=u,
            )
        )
        made.append(touch.made(resolution))
    if not drifts:
        raise _nothing_touched()
    distances = [drift.distance_mm for drift in drifts]
    verdict = cal.worst_of([cal.judge_drift(mm, u, tolerance) for mm in distances])
    codes: tuple[str, ...] = () if all(made) else ("not_touched",)
    codes += (verdict.value,) if verdict.value else ()
    return {
        "drift_mm": distances,
        "max_drift_mm": max(distances),
        "guard_band_mm": cal.GUARD_FACTOR * u,
    } | _verdict(codes, refuses=codes != (cal.DriftVerdict.UNDECIDED.value,))


def _nothing_touched() -> CalibrationError:
    return CalibrationError(
        "too_few_poses",
        tr("No touch was given."),
        remedy=tr("Touch the pin at one angle at least, better at two."),
    )


def _verdict(codes: tuple[str, ...], *, refuses: bool) -> Payload:
    """Return how a case ends, with a sentence about each ground."""
    if not codes:
        return {"codes": []}
    if not refuses:
        return {"codes": list(codes)}
    return {
        "status": "error",
        "codes": list(codes),
        "what": " ".join(spoken(_GROUNDS[code]) for code in codes),
        "remedy": tr("Touch the pin again, each time until the tip is on it."),
    }


_GROUNDS: Final = {
    "not_touched": declared("A touch was not made: the robot is where it stopped."),
    "typed_ahead": declared("An answer came before its question could be read."),
    "touch_heights_differ": declared(
        "Heights differ on one pin: at least one touch was in the air."
    ),
    "touch_not_proven": declared("The standoffs before the touches were not undone."),
    "large_residual": declared("One touch does not fit the others."),
    "large_drift": declared("The tip is too far off when the tool turns."),
    "drift_undecided": declared("The drift is too near to the tolerance to decide."),
}


def _touch(node: Node) -> "cal.WitnessedTouch":
    arrival = None if node.raw("arrival") is None else read_pose(node.child("arrival"))
    touch = cal.WitnessedTouch(
        read_pose(node.child("captured")),
        arrival,
        _standoff(node) if "standoff" in node else cal.Standoff(),
        node.optional("seconds", node.number),
        contact=_flag(node, "contact"),
    )
    node.finish()
    return touch


def _found(node: Node) -> "cal.WitnessedTouch":
    touch = cal.WitnessedTouch(
        read_pose(node.child("found")),
        read_pose(node.child("arrival")),
        contact=_flag(node, "contact"),
    )
    node.finish()
    return touch


def _standoff(node: Node) -> "cal.Standoff":
    given = node.child("standoff")
    standoff = cal.Standoff(*(given.number_or(axis, 0.0) for axis in "xyz"))
    given.finish()
    return standoff


def _flag(node: Node, name: str) -> bool:
    value = node.optional(name, node.raw)
    if not isinstance(value, (bool, type(None))):
        raise unusable(node.at(name), tr("true or false is expected here"))
    return bool(value)


TOUCH_METHODS: Final[Mapping[str, Callable[[Node], Payload]]] = {
    "touch_evidence": touch_evidence,
    "verify_evidence": verify_evidence,
}
"""Methods by the names that the shared cases use."""


_AXES: Final = ("nozzle", "person", "repeat")


def plane_touch(node: Node) -> Payload:
    """A tip that touched a plane in several orientations."""
    plane = node.optional("plane", lambda name: _plane(node.child(name)))
    sigma = node.optional("sigma_mm", node.number)
    result = cal.solve_plane_touch(read_poses(node), plane=plane, sigma_mm=sigma)
    return result_payload(result) | result.details()


def sphere_touch(node: Node) -> Payload:
    """A tip that touched a sphere in several orientations."""
    radius, sigma = (node.optional(name, node.number) for name in ("radius_mm", "sigma_mm"))
    result = cal.solve_sphere_touch(read_poses(node), radius_mm=radius, sigma_mm=sigma)
    return result_payload(result) | result.details()


def _plane(node: Node) -> "cal.TouchedPlane":
    normal, distance = node.numbers("normal"), node.number("distance_mm")
    node.finish()
    if len(normal) != 3 or not any(normal):
        raise unusable(node.at("normal"), tr("three numbers are expected here, not all of them 0"))
    return cal.TouchedPlane((normal[0], normal[1], normal[2]), distance)


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
    study = cal.gauge_study(
        _table(node, axes), tolerance_mm=node.optional("tolerance_mm", node.number)
    )
    between = study.reproducibility_limits_mm
    return {
        "codes": list(study.warnings),
        "notes": list(study.notes),
        "repeatability_mm": study.repeatability_mm,
        "reproducibility_mm": study.reproducibility_mm,
        "grr_mm": study.grr_mm,
        "part_mm": study.part_mm,
        "interaction_p": study.interaction_p,
        "interaction_pooled": study.interaction_pooled,
        "percent_of_tolerance": study.percent_of_tolerance,
        "percent_of_total": study.percent_of_total,
        "ndc": study.ndc,
        "repeatability_dof": study.repeatability_dof,
        "repeatability_limits_mm": list(study.repeatability_limits_mm),
        "reproducibility_limits_mm": None if between is None else list(between),
        "reproducibility_upper95_mm": study.reproducibility_upper95_mm,
    }


def control_chart(node: Node) -> Payload:
    """Later calibrations against the first ones."""
    chart = cal.control_chart(
        node.numbers("baseline"),
        node.numbers("values") if "values" in node else (),
        weight=node.number_or("lambda", cal.USUAL_LAMBDA),
        ewma_width=node.number_or("ewma_width", cal.USUAL_WIDTH),
    )
    return {
        "codes": list(chart.warnings),
        "notes": list(chart.notes),
        "centre": chart.centre,
        "sigma_mm": chart.sigma_mm,
        "limits": None if chart.limits is None else list(chart.limits),
        "points_out": None if chart.points_out is None else list(chart.points_out),
        "ewma": None if chart.ewma is None else list(chart.ewma),
        "ewma_first": chart.ewma_first,
    }


def _axes(node: Node, name: str) -> tuple[str, ...]:
    value = node.raw(name)
    if not isinstance(value, list) or sorted(map(str, value)) != sorted(_AXES):
        raise unusable(
            node.at(name),
            tr("these three are expected, in any order: {words}", words=", ".join(_AXES)),
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
        return table  # what is missing is named by the solver
    place = [axes.index(axis) for axis in _AXES]
    n, o, r = (next(iter(sizes[at])) for at in place)
    found = [[[0.0] * r for _ in range(o)] for _ in range(n)]
    for index in product(range(n), range(o), range(r)):
        i, j, k = (index[place.index(at)] for at in range(3))
        found[index[0]][index[1]][index[2]] = table[i][j][k]
    return found


def _list(value: object, path: str) -> list[object]:
    if not isinstance(value, list):
        raise unusable(path, tr("a list is expected here"))
    return value


STUDY_METHODS: Final[Mapping[str, Callable[[Node], Payload]]] = {
    "plane_touch": plane_touch,
    "sphere_touch": sphere_touch,
    "gauge_rr": gauge_rr,
    "control_chart": control_chart,
}
"""Methods by the names that a file gives them."""
