"""Cases of ``solve`` with poses: on one point, for a turn test, and none yet."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from robolink import calibration as cal
from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, json_fields
from robolink_cli.commands.measure.solve.case import (
    EULER,
    Node,
    Payload,
    read_offset,
    read_place,
    read_pose,
    read_poses,
    unusable,
)
from robolink_cli.views.solve import result_payload


@dataclass(frozen=True, slots=True)
class _Given:
    """The values that every method of this module takes.

    Attributes:
        poses: Flange poses, converted where tools and locals are known.
        options: For the solver.
        stored: The offset stored now.
        as_taught: Whether they are all that is known of touches of one pin, so that what a
            calibration from given poses refuses is refused here too: a case may know better.
        planar: Whether they are solved in the plane.
    """

    poses: list[Pose]
    options: dict[str, object]
    stored: ToolOffset | None
    as_taught: bool = False
    planar: bool = False

    def solved(self, solver: Callable[..., CalibrationResult], **more: object) -> CalibrationResult:
        """Return the result, unless its units are suspect."""
        mixed = not (self.as_taught and self.planar)
        result = solver(self.poses, allow_mixed_hand=mixed, **{**self.options, **more})
        cal.require_stored_scale(result, self.stored)
        if self.as_taught and self.planar:
            from robolink.procedures import require_one_height

            heights = [pose.z_mm for pose in self.poses]
            require_one_height(heights, sigma_z_mm=cal.PERSON_SIGMA_Z_MM)
        return result


def two_pose(node: Node) -> Payload:
    """Two flange poses on one point."""
    given = _given(node, turning=True)
    if len(given.poses) > 2:
        raise unusable(node.at("poses"), tr("expected: two poses; n_angle takes more"))
    if len(given.poses) < 2:
        return result_payload(given.solved(cal.solve_n_angle))
    return result_payload(
        given.solved(lambda poses, **options: cal.solve_two_pose(*poses, **options))
    )


def n_angle(node: Node) -> Payload:
    """Several flange poses of four axes on one point."""
    node.ignore("nan_fields")
    return result_payload(_given(node, turning=True).solved(cal.solve_n_angle))


def n_angle_robust(node: Node) -> Payload:
    """The same, with a search for outliers."""
    return _robust(node, cal.solve_n_angle, turning=True)


def pivot(node: Node) -> Payload:
    """Flange poses of six axes on one point."""
    return result_payload(_given(node, turning=False).solved(cal.solve_pivot))


def pivot_robust(node: Node) -> Payload:
    """The same, with a search for outliers."""
    return _robust(node, cal.solve_pivot, turning=False)


def six_point(node: Node) -> Payload:
    """A pivot and two moves along the tool's axes."""
    result = node.call(cal.solve_six_point, "second_is pivot_poses along_x second start sigma_mm")
    return result_payload(result) | json_fields(result, "off_square_deg")


def tool_axis(node: Node) -> Payload:
    """Two touches along one axis of the tool."""
    axis = node.call(cal.solve_tool_axis, "first second sigma_mm")
    return json_fields(axis, "direction", "tilt_deg", "sigma_deg")


def joint(node: Node) -> Payload:
    """Several tools on one pin, or one tool on several pins."""
    result = node.call(cal.solve_joint, "touches sigma_mm")
    tools = {str(tool): result_payload(found) for tool, found in result.tools.items()}
    first = next(iter(result.tools.values()))
    return {
        "codes": list(first.warnings),
        "tools": tools,
        "pins": {str(pin): list(place) for pin, place in result.pins_mm.items()},
    }


def verify(node: Node) -> Payload:
    """Flange poses on one point, with the offset to test."""
    result = node.call(cal.verify_drift, "poses offset tolerance_mm")
    return {
        "codes": [*result.warnings, *([] if result.passed else ["large_drift"])],
        **json_fields(result, "passed", "max_drift_mm", "tolerance_mm"),
        "drifts": [json_fields(drift, "u_deg", "distance_mm") for drift in result.drifts],
    }


def suggest_poses(node: Node) -> Payload:
    """The most informative poses."""
    plan = node.call(
        cal.suggest_poses,
        "taken",
        point_mm=read_place(node.child("point"), "xyz"),
        count=node.whole("count"),
        guess=read_offset(node.child("guess")),
        limits=node.call(cal.PoseLimits, "u_min_deg u_max_deg tilt_deg box"),
    )
    return {
        "poses": [dict(zip("xyzuvw", pose.coordinates(), strict=True)) for pose in plan.poses],
        # JSON has no infinity, which would be the value after the first pose.
        "sigma_gains": [None if gain == float("inf") else gain for gain in plan.sigma_gains],
    }


def uncertainty_budget(node: Node) -> Payload:
    """Sources of uncertainty, and their sum."""
    rows, unknown, values = [], [], []
    for child in node.children("rows"):
        row = _row(child)
        child.finish()
        values.append(None if row is None else row.u_mm)
        if row is None:
            unknown.append(child.text("name"))
        else:
            rows.append(row)
    probability = node.number_or("probability", 0.95)
    if not rows:
        raise unusable(node.at("rows"), tr("expected: at least one row with a value"))
    if not 0 < probability < 1:
        raise unusable(node.at("probability"), tr("expected: a number between 0 and 1"))
    budget = cal.UncertaintyBudget.of(rows, not_assessed=unknown, probability=probability)
    found = budget.as_json()
    return {
        "u_mm": values,
        "u_c_mm": budget.u_c_mm,
        "nu_eff": found["nu_eff"],
        "coverage_factor": budget.k,
        "expanded_mm": budget.expanded_mm,
        "not_assessed": unknown,
        "budget": found,
    }


def _robust(node: Node, solver: Callable[..., CalibrationResult], *, turning: bool) -> Payload:
    threshold = node.optional("inlier_threshold", node.number)
    if threshold is not None and threshold <= 0:
        raise unusable(node.at("inlier_threshold"), tr("expected: a positive number"))
    usual = cal.Robust(threshold)
    seeds = node.optional("seeds", lambda name: tuple(map(_seed, node.numbers(name))))
    one = node.optional("seed", node.whole)
    chosen = seeds or (usual.seeds if one is None else (abs(one),))
    given = _given(node, turning=turning)
    grid = given.options["grid_mm"]
    floor_mm = grid / math.sqrt(12) if isinstance(grid, float) else 0.0
    robust = cal.Robust(threshold, max(usual.resolution_mm, floor_mm), seeds=chosen)
    payload = result_payload(given.solved(solver, robust=robust))
    plain = solver(given.poses, allow_mixed_hand=True, **given.options)
    lengths = [getattr(plain.offset, name) for name in plain.measured]
    return payload | {"plain_ls_offset": lengths}


def _seed(value: float) -> int:
    return abs(int(value))


def _given(node: Node, *, turning: bool) -> _Given:
    """Read poses and options, and refuse poses whose unit is suspect."""
    options: dict[str, object] = {
        "sigma_mm": node.optional("sigma_mm", node.number),
        "grid_mm": node.optional("jog_grid_mm", node.number),
    }
    if turning:
        options["min_rotation_deg"] = node.number_or("min_delta_u_deg", cal.MIN_ROTATION_DEG)
    else:
        node.optional("euler", lambda key: node.text(key, EULER))
    stored = node.optional("stored", lambda name: read_offset(node.child(name)))
    robot = node.optional("robot", lambda name: _reach(node.child(name)))
    live = node.optional("live", lambda name: read_pose(node.child(name)))
    poses = read_poses(node)
    in_base = [pose for pose in poses if not pose.local and not pose.tool]
    if len(in_base) == len(poses):
        _require_units(in_base, robot, live)
    as_taught = bool(node.optional("as_taught", node.raw))
    return _Given(poses, options, stored, as_taught, turning)


def _require_units(
    poses: Sequence[Pose], robot: "cal.RobotReach | None", live: Pose | None
) -> None:
    if robot is not None:
        cal.require_within_reach(poses, robot)
    if live is not None:
        cal.require_near(poses, live)


def _reach(node: Node) -> "cal.RobotReach | None":
    reach = node.optional("reach_mm", node.number)
    inner = node.optional("inner_mm", node.number)
    kind = node.optional("kind", node.text)
    node.ignore("model", "name")
    node.finish()
    if reach is None:
        return None
    return cal.RobotReach(reach, 0.0 if kind in ("gantry", "delta", "cartesian") else inner)


def _row(node: Node) -> "cal.BudgetRow | None":
    """Return a row of a budget; ``None`` where it has no value."""
    name = node.text("name")
    nu = node.optional("dof", node.raw)
    origin = node.optional("origin", node.text) or ""
    kind = node.optional("type", lambda key: node.text(key, "A", "B")) or "B"
    sensitivity = node.number_or("sensitivity", 1.0)
    shape = node.optional("distribution", lambda key: node.text(key, *cal.DIVISORS))
    value = _standard_uncertainty(node, shape or "rectangular")
    if value is None:
        return None
    dof = math.inf if nu is None else node.number("dof")
    if value < 0 or dof <= 0:
        raise unusable(
            node.path, tr("expected: a positive uncertainty and positive degrees of freedom")
        )
    return cal.BudgetRow(name, value, dof, sensitivity, origin, "A" if kind == "A" else "B")


def _standard_uncertainty(node: Node, shape: str) -> float | None:
    """Return the standard uncertainty that a row states in any form, mm.

    ``u_mm``; ``half_width_mm`` with a distribution; the same with ``_deg`` and ``lever_mm``, with
    ``_K`` and ``alpha_per_K`` and ``length_mm``, or ``u_scale`` and ``distance_mm``.
    """
    units = {
        "mm": (),
        "deg": ("lever_mm",),
        "K": ("alpha_per_K", "length_mm"),
        "scale": ("distance_mm",),
    }
    for unit, factors in units.items():
        for stated, divisor in ((f"u_{unit}", 1.0), (f"half_width_{unit}", cal.DIVISORS[shape])):
            if stated not in node:
                continue
            if node.optional(stated, node.raw) is None:
                node.ignore(*factors)
                return None
            turned = math.pi / 180 if unit == "deg" else 1.0
            size = math.prod([abs(node.number(factor)) for factor in factors])
            return node.number(stated) * turned * size / divisor
    return None
