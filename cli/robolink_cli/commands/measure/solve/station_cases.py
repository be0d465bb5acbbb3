"""What ``solve`` takes of stations: lengths told by heights, shifts, chains."""

from collections.abc import Callable, Mapping
from typing import Final, cast

from robolink import calibration as cal
from robolink.messages import tr
from robolink_cli.commands.measure.solve.case import Node, unusable

Payload = dict[str, object]

_SHARED: Final = "previous_touch"


def length_change(node: Node) -> Payload:
    """Heights of the touches of two runs on one pin."""
    found = cal.length_change(
        node.numbers("before_z"),
        node.numbers("after_z"),
        stored_z_mm=node.number("stored_z"),
        v_deg=node.number_or("v", 0.0),
        w_deg=node.number_or("w", 0.0),
        sigma_z_mm=node.number_or("sigma_z_mm", cal.PERSON_SIGMA_Z_MM),
        pin_moved=_flag(node, "pin_moved"),
    )
    decision = _decision(node)
    undecided = found.changed and decision is None
    payload: Payload = {
        "status": "error" if undecided else "warn" if found.changed else "ok",
        "codes": ["length_changed"] if found.changed else [],
        "height_change_mm": found.height_change_mm,
        "u_mm": found.u_mm,
        "limit_mm": found.limit_mm,
        "z_by_difference_mm": found.z_by_difference_mm,
        "offset_z": None if undecided else found.z_mm(decision),
    }
    if undecided:
        payload |= {
            "what": tr(
                "The tip is {longer:+.3f} mm longer (+-{half}), and nobody decided what is "
                "written.",
                longer=found.longer_mm,
                half=cal.stated_mm(found.half95_mm),
            ),
            "remedy": tr("Decide: difference, keep, or measure."),
        }
    return payload


def station_shift(node: Node) -> Payload:
    """By how much a station seems to have moved, tool by tool."""
    shifts = [_shift(child) for child in node.children("shifts")]
    if not shifts:
        raise unusable(node.at("shifts"), tr("at least one shift is needed"))
    found = cal.judge_shifts(shifts, seat_changes=node.optional("seat_changes", node.whole))
    assert found is not None  # noqa: S101 - there are shifts
    tolerance_mm = node.optional("tolerance_mm", node.number)
    payload: Payload = {
        "codes": [],
        "common_mm": list(found.vector_mm),
        "u_mm": list(found.sigma_mm),
        "chi_square": found.chi_square,
        "chi_square_limit": found.chi_square_limit,
        "detectable_mm": found.detectable_mm,
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
        raise unusable(node.at("changes"), tr("0 or more is expected"))
    # Whatever is no shared touch is two touches a change, which is the larger.
    shared = node.text("reference") == _SHARED
    u_mm = cal.chain_sigma_mm(
        node.number("u0_mm"), node.number("sigma_mm"), changes, shared_touch=shared
    )
    return {"u_mm": u_mm}


def station_chain(node: Node) -> Payload:
    """Tools that were each touched once at one station."""
    shared = cal.shared_station(node.number("u_station_mm"), node.number("sigma_mm"))
    tools = node.numbers("tools")
    return {
        "u_mm": [shared.u_mm] * len(tools),
        "correlation": shared.correlation,
        "u_difference_mm": shared.u_difference_mm,
    }


def _shift(node: Node) -> "cal.TipShift":
    tool, vector = node.whole("tool"), tuple(node.numbers("vector"))
    seat = tuple(node.optional("seat_sigma_mm", node.numbers) or ())
    sigma_mm = node.number("touch_sigma_mm")
    node.finish()
    if len(vector) not in (1, 2, 3):
        raise unusable(node.at("vector"), tr("one, two or three numbers are expected"))
    if seat and len(seat) < len(vector):
        raise unusable(node.at("seat_sigma_mm"), tr("one number for each axis is expected"))
    cal.require_positive(sigma_mm, "touch_sigma_mm")
    return cal.TipShift(tool, vector, sigma_mm, seat)


def _decision(node: Node) -> "cal.LengthDecision | None":
    if node.optional("decision", node.raw) is None:
        return None
    return cast("cal.LengthDecision", node.text("decision", "difference", "keep", "measure"))


def _flag(node: Node, name: str) -> bool:
    value = node.optional(name, node.raw)
    if value not in (None, True, False):
        raise unusable(node.at(name), tr("true or false is expected here"))
    return bool(value)


STATION_METHODS: Final[Mapping[str, Callable[[Node], Payload]]] = {
    "length_change": length_change,
    "station_shift": station_shift,
    "needle_chain": needle_chain,
    "station_chain": station_chain,
}
"""Methods by the names that the shared cases use."""
