"""What ``solve`` takes beyond one tip on one point: beams, changes, axes, runout and proofs."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Final, Literal

from robolink import calibration as cal
from robolink.messages import tr
from robolink.methods import BeamsParameters
from robolink.model import WorkBox
from robolink_cli.commands.measure.solve.case import (
    Node,
    read_offset,
    read_point,
    read_pose,
    read_poses,
    unusable,
)
from robolink_cli.commands.measure.solve.sighting_cases import known_tip
from robolink_cli.views.solve import result_payload, space_payload

Payload = dict[str, object]


def needle_change(node: Node) -> Payload:
    """A new needle by difference."""
    chain = node.child("chain")
    known = cal.NeedleChain(chain.number("sigma_mm"), chain.optional("changes", chain.whole) or 0)
    chain.finish()
    result = cal.solve_needle_change(
        read_pose(node.child("flange")),
        _place(node.child("before")),
        _place(node.child("after")),
        stored=read_offset(node.child("stored")),
        chain=known,
        sigma_mm=node.number("sigma_mm"),
    )
    return space_payload(result) | {
        "shift_mm": list(result.shift_mm),
        "chain": {"sigma_mm": result.chain.sigma_mm, "changes": result.chain.changes},
        "full_calibration_due": result.full_calibration_due,
    }


def one_touch(node: Node) -> Payload:
    """A pin that is known, or that the last tip touched, and one touch."""
    spread = node.number_or("pin_sigma_mm", 0.0)
    if "last" in node:
        last = node.child("last")
        offset = read_offset(last.child("offset"))
        pin = cal.pin_touched(read_pose(last.child("flange")), offset, sigma_mm=spread)
        last.finish()
    else:
        given = node.child("pin")
        pin = cal.Pin(given.number("x"), given.number("y"), given.number("z"), spread)
        given.finish()
    flange = read_pose(node.child("flange"))
    sigma = node.optional("sigma_mm", node.number)
    return result_payload(cal.solve_one_touch(flange, pin, sigma_mm=sigma))


def crossed_beams(node: Node) -> Payload:
    """Travels through two beams whose places are known."""
    from robolink.methods.beams.crossings import require_straight  # numpy, late

    beams = [_beam(child) for child in node.children("beams")]
    if len(beams) != 2:
        raise unusable(node.at("beams"), tr("two beams are needed"))
    known, height = known_tip(node)
    result = cal.solve_crossed_beams(
        [_crossing(child) for child in node.children("crossings")],
        (beams[0], beams[1]),
        stored=known,
        height=height,
        sigma_mm=node.optional("sigma_mm", node.number),
        beams_may_have_moved=bool(node.optional("beams_may_have_moved", node.raw)),
        shaft=node.optional("shaft", lambda name: _shaft(node.child(name))),
        step_mm=node.optional("step_mm", node.number),
    )
    require_straight(result, node.number_or("max_lean_deg", BeamsParameters.max_lean_deg))
    covariance = result.covariance
    return result_payload(result) | {
        "lag_mm": list(result.lag_mm),
        "u_mm": [row[index] ** 0.5 for index, row in enumerate(covariance)],
        "u_without_beams_mm": list(result.u_without_beams_mm),
        "half_width95": list(result.half_width95),
        **result.details(),
    }


def _shaft(node: Node) -> cal.ShaftSeen:
    """Return crossings of a needle's shaft, and how far above its end the beams saw it."""
    seen = cal.ShaftSeen(
        [_crossing(child) for child in node.children("crossings")],
        node.number("above_mm"),
        node.number("deeper_mm"),
    )
    node.finish()
    return seen


def find_beams(node: Node) -> Payload:
    """Where two beams are, from a pin whose tip is known."""
    crossings = [_crossing(child) for child in node.children("crossings")]
    beams = cal.find_beams(
        crossings,
        read_point(node.child("tip")),
        tip_sigma_mm=node.number_or("tip_sigma_mm", 0.0),
        sigma_mm=node.optional("sigma_mm", node.number),
    )
    return {
        "beams": [
            {
                "x": beam.x_mm,
                "y": beam.y_mm,
                "direction_deg": beam.direction_deg,
                "sigma_mm": beam.sigma_mm,
                "direction_sigma_deg": beam.direction_sigma_deg,
                "correlation": beam.correlation,
            }
            for beam in beams
        ]
    }


def z_touch(node: Node) -> Payload:
    """Touches of a surface at two speeds, or at three."""
    touches = []
    for child in node.children("touches"):
        touches.append(cal.Touch(child.number("z"), child.number("speed_mm_s")))
        child.finish()
    result = cal.solve_z_touch(
        touches,
        node.number("surface_z"),
        stored=node.optional("stored", lambda name: read_offset(node.child(name))),
        flange=node.optional("flange", lambda name: read_pose(node.child(name))),
        latency_s=node.optional("latency_s", node.number),
        deceleration_mm_s2=node.number_or("deceleration_mm_s2", cal.USUAL_DECELERATION_MM_S2),
        sigma_mm=node.optional("sigma_mm", node.number),
        step_mm=node.optional("step_mm", node.number),
    )
    return result_payload(result) | {
        "offset_z": result.offset.z_mm,
        "flange_z": result.flange_z_mm,
        "latency_s": result.latency_s,
        "overshoot_s2_per_mm": result.overshoot_s2_per_mm,
        "f_quadratic": result.f_quadratic,
        "f_limit": result.f_limit,
    }


def six_point(node: Node) -> Payload:
    """A pivot and two ways along the tool's axes."""
    second: Literal["z", "xz"] = "z"
    if node.optional("second_is", lambda name: node.text(name, "z", "xz")) == "xz":
        second = "xz"
    result = cal.solve_six_point(
        read_poses(node, "pivot_poses"),
        read_pose(node.child("along_x")),
        read_pose(node.child("second")),
        start=node.optional("start", lambda name: read_pose(node.child(name))),
        second_is=second,
        sigma_mm=node.optional("sigma_mm", node.number),
    )
    return result_payload(result) | {"off_square_deg": result.off_square_deg}


def tool_axis(node: Node) -> Payload:
    """Two touches along one axis of the tool."""
    axis = cal.solve_tool_axis(
        read_pose(node.child("first")),
        read_pose(node.child("second")),
        sigma_mm=node.optional("sigma_mm", node.number),
    )
    return {
        "direction": list(axis.direction),
        "tilt_deg": axis.tilt_deg,
        "sigma_deg": axis.sigma_deg,
    }


def runout(node: Node) -> Payload:
    """A tip seen while the tool turns."""
    sightings = []
    for child in node.children("sightings"):
        flange = read_pose(child.child("flange"))
        sightings.append(cal.Sighting(flange, *read_point(child.child("tip"))))
        child.finish()
    report = cal.runout_report(sightings, sigma_mm=node.optional("sigma_mm", node.number))
    return {
        "codes": list(report.warnings),
        "offset": list(report.tip_mm),
        "half_width95_mm": report.half_width95_mm,
        "centre": list(report.centre_mm),
        "centre_mm": list(report.centre_mm),
        "runout_mm": report.runout_mm,
        "ellipse_mm": report.ellipse_mm,
        "second_mm": report.second_mm,
        "amplitude_limit_mm": report.amplitude_limit_mm,
        "distinct_angles": report.distinct_angles,
        "rank": report.rank,
        "rms_mm": report.rms_mm,
        "peak_mm": report.peak_mm,
        "harmonics_matter": report.harmonics_matter,
    }


def joint(node: Node) -> Payload:
    """Several tools on one pin, or one tool on several pins."""
    touches = []
    for child in node.children("touches"):
        pin = child.optional("pin", child.whole) or 0
        tool = child.whole("tool")
        touches.append(cal.JointTouch(read_pose(child.child("flange")), tool, pin))
        child.finish()
    result = cal.solve_joint(touches, sigma_mm=node.optional("sigma_mm", node.number))
    tools = {str(tool): result_payload(found) for tool, found in result.tools.items()}
    first = next(iter(result.tools.values()))
    return {
        "codes": list(first.warnings),
        "tools": tools,
        "pins": {str(pin): list(place) for pin, place in result.pins_mm.items()},
    }


def verify(node: Node) -> Payload:
    """Flange poses on one point, with the offset that is to be proved."""
    result = cal.verify_drift(
        read_poses(node),
        read_offset(node.child("offset")),
        tolerance_mm=node.number_or("tolerance_mm", cal.PLACING_TOLERANCE_MM),
    )
    return {
        "codes": [*result.warnings, *([] if result.passed else ["large_drift"])],
        "passed": result.passed,
        "max_drift_mm": result.max_drift_mm,
        "tolerance_mm": result.tolerance_mm,
        "drifts": [{"u_deg": d.u_deg, "distance_mm": d.distance_mm} for d in result.drifts],
    }


def update_guard(node: Node) -> Payload:
    """A new offset against the stored one."""
    correction = cal.update_guard(
        read_offset(node.child("new")),
        stored=read_offset(node.child("stored")),
        earlier_mm=node.optional("earlier_mm", node.numbers) or (),
        max_change_mm=node.number_or("max_change_mm", cal.NEEDLE_LIMIT_MM),
    )
    return {"correction_mm": correction.distance_mm, "ratio": correction.ratio}


def suggest_poses(node: Node) -> Payload:
    """The poses that tell the most."""
    point = node.child("point")
    place = (point.number("x"), point.number("y"), point.number("z"))
    point.finish()
    usual = cal.PoseLimits()
    plan = cal.suggest_poses(
        node.whole("count"),
        guess=read_offset(node.child("guess")),
        point_mm=place,
        limits=cal.PoseLimits(
            node.number_or("u_min_deg", usual.u_min_deg),
            node.number_or("u_max_deg", usual.u_max_deg),
            node.number_or("tilt_deg", usual.tilt_deg),
            node.optional("box", lambda name: _box(node.child(name))),
        ),
        taken=node.optional("taken", lambda name: read_poses(node, name)) or (),
    )
    return {
        "poses": [dict(zip("xyzuvw", pose.coordinates(), strict=True)) for pose in plan.poses],
        # JSON has no infinity: after the first pose nothing is known yet.
        "sigma_gains": [None if gain == float("inf") else gain for gain in plan.sigma_gains],
    }


def _place(node: Node) -> tuple[float, ...]:
    place = [node.number("x"), node.number("y")]
    height = node.optional("z", node.number)
    node.finish()
    return tuple(place if height is None else [*place, height])


def _box(node: Node) -> WorkBox:
    sides = {name: node.number_or(name, usual) for name, usual in asdict(WorkBox()).items()}
    node.finish()
    return WorkBox(**sides)


def _beam(node: Node) -> "cal.Beam":
    beam = cal.Beam(
        node.number("x"),
        node.number("y"),
        node.number("direction_deg"),
        sigma_mm=node.number_or("sigma_mm", 0.0),
        direction_sigma_deg=node.number_or("direction_sigma_deg", 0.0),
        correlation=node.number_or("correlation", 0.0),
    )
    node.finish()
    return beam


def _crossing(node: Node) -> "cal.Crossing":
    beam = node.whole("beam")
    if beam not in (1, 2):
        raise unusable(node.at("beam"), tr("the beams are numbered 1 and 2"))
    entry, exit_ = read_pose(node.child("entry")), read_pose(node.child("exit"))
    node.finish()
    return cal.Crossing(beam - 1, entry, exit_)


MORE_METHODS: Final[Mapping[str, Callable[[Node], Payload]]] = {
    "needle_change": needle_change,
    "one_touch": one_touch,
    "crossed_beams": crossed_beams,
    "find_beams": find_beams,
    "z_touch": z_touch,
    "six_point": six_point,
    "tool_axis": tool_axis,
    "runout": runout,
    "joint": joint,
    "verify": verify,
    "update_guard": update_guard,
    "suggest_poses": suggest_poses,
}
