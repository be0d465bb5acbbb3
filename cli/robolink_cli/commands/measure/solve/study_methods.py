"""Methods of ``solve`` beside tips on points: surfaces that were touched, and two studies."""

from collections.abc import Callable, Mapping
from itertools import product
from typing import Final

from robolink import calibration as cal
from robolink.messages import tr
from robolink_cli.commands.measure.solve.case import Node, finite, read_poses, unusable
from robolink_cli.views.solve import result_payload

Payload = dict[str, object]

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
