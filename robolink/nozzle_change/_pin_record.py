"""Where a calibration puts the pin, and what the journal keeps of it."""

import math
from collections.abc import Iterator, Sequence
from statistics import fmean

from robolink.calibration import (
    NORMAL_95,
    CalibrationResult,
    NeedleChain,
    chain_of,
    offset_sigma_mm,
)
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods import AnyMethod, NextStep, all_methods
from robolink.model import Pose, ToolOffset
from robolink.nozzle_change._proposal import Proposal
from robolink.nozzle_change._seating import TouchWitness, touched_by
from robolink.stations import Found, Station, StationKind


def finds_pin(result: CalibrationResult) -> bool:
    """Tell whether a measurement found the pin itself, with the offset."""
    return any(method.needs.finds_pin for method in _methods_of(result))


def tells_height(result: CalibrationResult) -> bool:
    """Tell whether the heights of the touches say how long the tip is, beside what was solved."""
    return "z_mm" not in result.found and any(method.tells_height for method in _methods_of(result))


def next_steps(result: CalibrationResult, tool: int) -> tuple[NextStep, ...]:
    """Return what a person does next with a tool that was written; nothing for most methods.

    Args:
        result: The measurement.
        tool: Number of the tool.
    """
    made = (method.next_steps for method in _methods_of(result))
    return tuple(step for make in made if make is not None for step in make(tool))


def _methods_of(result: CalibrationResult) -> Iterator[AnyMethod]:
    yield from (method for method in all_methods() if method.name == result.method)


def require_pin_in_base(station: str, result: CalibrationResult) -> None:
    """Refuse to keep the place of a pin that was found from poses of a local coordinate system.

    The tip comes out the same in every local, the pin does not (docs/reference/evidence.md 4).

    Args:
        station: Name of the pin that is to be kept; empty for none.
        result: What was measured.

    Raises:
        CalibrationError: ``local_pose``.
    """
    local = next((pose.local for pose in _kept_inputs(result) if pose.local), 0)
    if not station or not local:
        return
    raise CalibrationError(
        "local_pose",
        tr(
            "These are positions in Local {local}; the place of station {station} is kept in the "
            "base.",
            local=local,
            station=station,
        ),
        remedy=tr("Take them in Local 0, or name no station: the tip is then found all the same."),
    )


def touch_heights_mm(proposal: Proposal) -> list[float]:
    """Return how high each touch puts the pin, if the tip is as long as the value says; base."""
    value = proposal.offset
    return [contact_of(pose, value)[2] for pose in _kept_inputs(proposal.result)]


def contact_of(pose: Pose, offset: ToolOffset) -> tuple[float, float, float]:
    """Return where a touch puts the pin, if the tip is where an offset says; base."""
    x_mm, y_mm, z_mm = _turned(pose, offset)
    return pose.x_mm + x_mm, pose.y_mm + y_mm, pose.z_mm + z_mm


def _kept_inputs(result: CalibrationResult) -> list[Pose]:
    return [pose for i, pose in enumerate(result.inputs) if i not in result.rejected]


def _turned(pose: Pose, offset: ToolOffset) -> tuple[float, float, float]:
    """Return an offset in base axes."""
    from robolink.calibration import rotation_of  # numpy, late

    rows = rotation_of(pose).tolist()
    along = offset.components()[:3]
    x, y, z = (sum(r * a for r, a in zip(row, along, strict=True)) for row in rows)
    return x, y, z


def pin_mm(proposal: Proposal) -> tuple[float, float, float]:
    """Return where the offset that was measured puts the pin, base."""
    result, tip = proposal.result, proposal.tip
    x_mm, y_mm = result.reference_point_mm[:2]
    if len(result.reference_point_mm) == 3:
        return x_mm, y_mm, result.reference_point_mm[2]
    heights = [contact_of(pose, tip)[2] for pose in _kept_inputs(result)]
    return x_mm, y_mm, fmean(heights)


def _touch_sigma_mm(result: CalibrationResult) -> float | None:
    """Return the same for one coordinate of one touch."""
    offset_mm = offset_sigma_mm(result)
    if offset_mm is None or result.sigma_mm is None:
        return None
    if result.sigma_stated and result.interval_from != "residuals":
        return result.sigma_mm
    largest = max(
        result.covariance[index][index]
        for index, name in enumerate(result.measured)
        if name.endswith("_mm")
    )
    return result.sigma_mm * offset_mm / math.sqrt(largest) if largest else result.sigma_mm


def found_pin(station: str, proposal: Proposal, known: Station | None = None) -> Found | None:
    """Return where a full calibration found the pin; ``None`` for one that only used it.

    Its height is never taken from a Z that was only kept: where the tip is another, the pin would
    be as wrong as the tip. What is known of the height then stays, unless the pin moved.

    Args:
        station: Name of the pin.
        proposal: The calibration.
        known: The pin as it was known before.
    """
    result = proposal.result
    if not finds_pin(result):
        return None
    x_mm, y_mm, measured_z_mm = pin_mm(proposal)
    z_mm, z_from = _height(proposal, measured_z_mm, known)
    return Found(
        id=station,
        kind=StationKind.PIN,
        x_mm=x_mm,
        y_mm=y_mm,
        z_mm=z_mm,
        # The place of the pin is as uncertain as the tip: the equations treat both alike.
        sigma_mm=offset_sigma_mm(result),
        how=tr("{method} with tool {tool}", method=result.method, tool=proposal.tool),
        tool=proposal.tool,
        details={"z_from": z_from, **_spread(result)},
    )


def _height(
    proposal: Proposal, measured_mm: float, known: Station | None
) -> tuple[float | None, str]:
    """Return the height of the pin and where it comes from."""
    if "z_mm" in proposal.result.measured:
        return measured_mm, "measured"
    if proposal.z_from == "typed":
        return measured_mm, "typed"
    if known is None or known.z_mm is None or "station_moved" in proposal.result.warnings:
        return None, ""
    return known.z_mm, str(known.details.get("z_from", ""))


def _spread(result: CalibrationResult) -> dict[str, object]:
    """Return the covariance of the pin, base, mm^2: as large as that of the tip, and turned."""
    lengths = [i for i, name in enumerate(result.measured) if name.endswith("_mm")]
    if not result.covariance or len(lengths) not in (2, 3):
        return {}
    # The normal equations are the same for tip and pin up to a turn; of the worst axis all are.
    # As wide as few degrees of freedom made the interval, for who reads it later knows of none.
    half = max(result.half_width95[i] for i in lengths)
    variance = (half / NORMAL_95) ** 2
    rows = [[variance if i == j else 0.0 for j in lengths] for i in lengths]
    return {"covariance_mm2": rows}


def touch_details(station: str, proposal: Proposal) -> dict[str, object]:
    """Return what the journal keeps of the pin beside a value that was kept."""
    result = proposal.result
    chain = chain_of(result) or NeedleChain(offset_sigma_mm(result) or 0.0)
    x_mm, y_mm, z_mm = pin_mm(proposal)
    # The next nozzle touches upright once: what counts is how this one stood upright last.
    touch = min(reversed(result.inputs), key=lambda pose: abs(pose.v_deg) + abs(pose.w_deg))
    # Where a difference was written, the value puts the pin elsewhere than the tip does.
    tip, value = _turned(touch, proposal.tip), _turned(touch, proposal.offset)
    heights = touch_heights_mm(proposal)
    height_mm = z_mm + value[2] - tip[2] if proposal.pin_z_mm is None else proposal.pin_z_mm
    return {
        "station": station,
        "x_mm": x_mm + value[0] - tip[0],
        "y_mm": y_mm + value[1] - tip[1],
        "z_mm": height_mm,
        "u_deg": touch.u_deg,
        "sigma_mm": chain.sigma_mm,
        "changes": chain.changes,
        "full_sigma_mm": chain.full_sigma_mm,
        "touch_sigma_mm": _touch_sigma_mm(result),
        # Tilted touches have Z from the fit, and their heights say nothing about it.
        **({} if "z_mm" in result.found else _scatter(heights, touched_by(result.inputs))),
        "touches": proposal.pin_touches or len(result.inputs) - len(result.rejected),
    }


def _scatter(heights_mm: Sequence[float], by: TouchWitness) -> dict[str, object]:
    """Return how much the heights of one run differ, for those who pool it with others."""
    mean = fmean(heights_mm)
    return {
        "heights_mm2": sum((height - mean) ** 2 for height in heights_mm),
        "heights_dof": len(heights_mm) - 1,
        "heights_by": by,
    }
