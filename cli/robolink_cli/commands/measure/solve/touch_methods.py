"""The methods of ``solve`` that judge how touches were made."""

from collections.abc import Callable, Mapping
from typing import Final

from robolink import calibration as cal
from robolink.errors import CalibrationError
from robolink.messages import declared, spoken, tr
from robolink_cli.commands.measure.solve.case import Node, read_pose, unusable

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
