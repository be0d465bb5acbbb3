"""Cases of ``solve`` with touches: how they were made, and the touched pins and surfaces."""

from typing import Final

from robolink import calibration as cal
from robolink.errors import CalibrationError
from robolink.messages import declared, spoken, tr
from robolink.model import json_fields
from robolink_cli.commands.measure.solve.case import Node, Payload, read_place, read_pose, unusable
from robolink_cli.views.solve import result_payload, space_payload


def needle_change(node: Node) -> Payload:
    """A new needle by difference."""
    result = node.call(
        cal.solve_needle_change,
        "stored sigma_mm",
        chain=node.child("chain").made(cal.NeedleChain, "sigma_mm changes"),
        flange=read_pose(node.child("flange")),
        before_mm=read_place(node.child("before")),
        after_mm=read_place(node.child("after")),
    )
    return space_payload(result) | {
        **json_fields(result, "shift_mm"),
        "chain": json_fields(result.chain, "sigma_mm", "changes"),
        **json_fields(result, "full_calibration_due"),
    }


def one_touch(node: Node) -> Payload:
    """A pin that is known, or that the last tip touched, and one touch."""
    spread = node.number_or("pin_sigma_mm", 0.0)
    if "last" in node:
        pin = node.child("last").made(cal.pin_touched, "offset flange", sigma_mm=spread)
    else:
        pin = node.child("pin").made(cal.Pin, "x y z", sigma_mm=spread)
    return result_payload(node.call(cal.solve_one_touch, "flange sigma_mm", pin=pin))


def z_touch(node: Node) -> Payload:
    """Touches of a surface at two speeds, or at three."""
    result = node.call(
        cal.solve_z_touch,
        "touches surface_z stored flange latency_s deceleration_mm_s2 sigma_mm step_mm",
    )
    return result_payload(result) | {
        "offset_z": result.offset.z_mm,
        "flange_z": result.flange_z_mm,
        **json_fields(result, "latency_s", "overshoot_s2_per_mm", "f_quadratic", "f_limit"),
    }


def plane_touch(node: Node) -> Payload:
    """A tip that touched a plane in several orientations."""
    result = node.call(cal.solve_plane_touch, "plane sigma_mm poses")
    return result_payload(result) | result.details()


def sphere_touch(node: Node) -> Payload:
    """A tip that touched a sphere in several orientations."""
    result = node.call(cal.solve_sphere_touch, "radius_mm sigma_mm poses")
    return result_payload(result) | result.details()


def touch_evidence(node: Node) -> Payload:
    """Touches of one pin, with where the robot stopped before each."""
    touches = [_touch(child) for child in node.children("touches")]
    if not touches:
        raise _nothing_touched()
    evidence = node.call(cal.judge_touches, "resolution_mm sigma_z_mm", touches=touches)
    seen = any(touch.arrival is not None or touch.contact for touch in touches)
    return {
        **json_fields(evidence, "z_range_mm", "z_limit_mm", "jog_mm", "gamma", "gamma_upper99"),
        **json_fields(evidence, "not_touched", "typed_ahead"),
        "max_residual": evidence.max_residual_mm,
        "notes": [] if seen else ["touches_not_witnessed"],
        **_verdict(evidence.codes, refuses=True),
    }


def verify_evidence(node: Node) -> Payload:
    """A turn test: where the tip should have been, where the robot stopped, where it was found."""
    tolerance, u = node.number("tolerance_mm"), node.number_or("u_drift_mm", cal.PERSON_U_DRIFT_MM)
    resolution = node.number_or("resolution_mm", 0.001)
    if tolerance <= 0 or u < 0:
        raise unusable(node.path, tr("expected: a tolerance above 0, and u_drift_mm 0 or more"))
    drifts, made = [], []
    for child in node.children("touches"):
        place, found = read_pose(child.child("place")), read_pose(child.child("found"))
        arrival = read_pose(child.child("arrival"))
        touch = child.made(cal.WitnessedTouch, "contact", captured=found, arrival=arrival)
        dx_mm, dy_mm = found.x_mm - place.x_mm, found.y_mm - place.y_mm
        drifts.append(cal.Drift(place.u_deg, dx_mm, dy_mm, u_mm=u))
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


def _touch(node: Node) -> cal.WitnessedTouch:
    arrival = None if node.raw("arrival") is None else read_pose(node.child("arrival"))
    names = "captured standoff seconds contact"
    return node.made(cal.WitnessedTouch, names, arrival=arrival)


def _nothing_touched() -> CalibrationError:
    return CalibrationError(
        "too_few_poses",
        tr("No touch was given."),
        remedy=tr("Touch the pin at one or more angles, better at two."),
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
        "remedy": tr("Touch the pin again. Each time, jog until the tip is on it."),
    }


_GROUNDS: Final = {
    "not_touched": declared("A touch was not made: the robot is still where it stopped."),
    "typed_ahead": declared("An answer came before anybody could read its question."),
    "touch_heights_differ": declared(
        "Heights differ on one pin: at least one touch was in the air."
    ),
    "touch_not_proven": declared("The standoffs before the touches were not undone."),
    "large_residual": declared("One touch does not fit the others."),
    "large_drift": declared("The tip is too far off when the tool turns."),
    "drift_undecided": declared("The drift is too near the tolerance to decide."),
}
