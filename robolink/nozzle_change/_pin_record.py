"""Where a calibration puts the pin, and what the journal keeps of it."""

import math
from statistics import fmean

from robolink.calibration import (
    CalibrationResult,
    NeedleChain,
    chain_of,
    offset_sigma_mm,
)
from robolink.messages import tr
from robolink.methods import all_methods
from robolink.model import (
    rotate_xy,
)
from robolink.nozzle_change._proposal import Proposal
from robolink.stations import Found, StationKind


def finds_pin(result: CalibrationResult) -> bool:
    """Tell whether a measurement found the pin itself, with the offset."""
    return any(method.needs.finds_pin and method.name == result.method for method in all_methods())


def pin_mm(proposal: Proposal) -> tuple[float, float, float]:
    """Return where the offset that was measured puts the pin, base."""
    result, tip = proposal.result, proposal.tip
    x_mm, y_mm = result.reference_point_mm[:2]
    if len(result.reference_point_mm) == 3:
        return x_mm, y_mm, result.reference_point_mm[2]
    # Upright: the tip ends as far below the flange as its offset says.
    return x_mm, y_mm, fmean(pose.z_mm for pose in result.inputs) + tip.z_mm


def _touch_sigma_mm(result: CalibrationResult) -> float | None:
    """Return the same for one coordinate of one touch."""
    offset_mm = offset_sigma_mm(result)
    if offset_mm is None or result.sigma_mm is None:
        return None
    if result.sigma_stated:
        return result.sigma_mm
    largest = max(
        result.covariance[index][index]
        for index, name in enumerate(result.measured)
        if name.endswith("_mm")
    )
    return result.sigma_mm * offset_mm / math.sqrt(largest) if largest else result.sigma_mm


def found_pin(station: str, proposal: Proposal) -> Found | None:
    """Return where a full calibration found the pin; ``None`` for one that only used it."""
    result = proposal.result
    if not finds_pin(result):
        return None
    x_mm, y_mm, z_mm = pin_mm(proposal)
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
    )


def touch_details(station: str, proposal: Proposal) -> dict[str, object]:
    """Return what the journal keeps of the pin beside a value that was kept."""
    result = proposal.result
    chain = chain_of(result) or NeedleChain(offset_sigma_mm(result) or 0.0)
    x_mm, y_mm, z_mm = pin_mm(proposal)
    # The next nozzle touches upright once: what counts is how this one stood upright last.
    touch = min(reversed(result.inputs), key=lambda pose: abs(pose.v_deg) + abs(pose.w_deg))
    # Where a difference was written, the value puts the pin elsewhere than the tip does.
    tip, value = proposal.tip, proposal.offset
    dx, dy = rotate_xy(value.x_mm - tip.x_mm, value.y_mm - tip.y_mm, touch.u_deg)
    return {
        "station": station,
        "x_mm": x_mm + dx,
        "y_mm": y_mm + dy,
        "z_mm": z_mm + value.z_mm - tip.z_mm,
        "u_deg": touch.u_deg,
        "sigma_mm": chain.sigma_mm,
        "changes": chain.changes,
        "touch_sigma_mm": _touch_sigma_mm(result),
    }
