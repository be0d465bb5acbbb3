"""Where a tool's calibration puts the pin: what one touch of the next nozzle is compared with.

The offset that is written and the touches that it came from say together where the pin is,
``P = p + R t``. As long as that offset stays stored and the pin stays where it is, a new tip that
touches the pin shows by how much it differs from the old one (docs/reference/calibration.md 2.9).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import fmean

from robolink.calibration import NORMAL_95, CalibrationResult, NeedleChain, chain_of
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import (
    Controller,
    EntryKind,
    Recorded,
    ToolOffset,
    describe_offset,
    read_offset,
    rotate_xy,
)
from robolink.nozzle_change._proposal import Proposal
from robolink.stations import Found, StationKind

FULL_METHODS = ("two_pose", "n_angle", "pivot", "six_point")
"""Methods that find the pin themselves, with the offset."""


KEPT = (EntryKind.DONE, EntryKind.DECISION)
"""Entries that say that a value stays, and what it rests on."""


@dataclass(frozen=True, slots=True)
class LastTouch:
    """The pin as a tool's last calibration on it places it.

    Attributes:
        station: Name of the pin.
        place_mm: Where it is then, base.
        u_deg: U of the flange at the last touch.
        value: The offset that was written with it.
        chain: What has happened since the last full calibration.
        touch_sigma_mm: Standard deviation of one coordinate of one touch then, ``None`` if nothing
            told it.
        nozzle: Id of the nozzle that was mounted, empty when nobody gave one.
        at: When, as a label.
    """

    station: str
    place_mm: tuple[float, float, float]
    u_deg: float
    value: ToolOffset
    chain: NeedleChain
    touch_sigma_mm: float | None
    nozzle: str
    at: str


def pin_mm(proposal: Proposal) -> tuple[float, float, float]:
    """Return where the offset that was measured puts the pin, base."""
    result, tip = proposal.result, proposal.tip
    x_mm, y_mm = result.reference_point_mm[:2]
    if len(result.reference_point_mm) == 3:
        return x_mm, y_mm, result.reference_point_mm[2]
    # Upright: the tip ends as far below the flange as its offset says.
    return x_mm, y_mm, fmean(pose.z_mm for pose in result.inputs) + tip.z_mm


def offset_sigma_mm(result: CalibrationResult) -> float | None:
    """Return how uncertain a measured length is, as a standard deviation; the largest of them.

    A scatter that was estimated from few poses is itself uncertain, and its 95 % interval is wider
    for that. What is kept is the standard deviation of a normal distribution whose interval is as
    wide, because whoever uses it later no longer knows from how many poses it came.

    Returns:
        ``None`` when nothing tells it.
    """
    widths = zip(result.measured, result.half_width95, strict=False)
    lengths = [half for name, half in widths if name.endswith("_mm")]
    return max(lengths) / NORMAL_95 if lengths else None


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
    if result.method not in FULL_METHODS:
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


def find_last_touch(controller: Controller, tool: int, station: str) -> LastTouch:
    """Return the last calibration of a tool on a pin, if it stands for what is stored.

    Raises:
        CalibrationError: ``no_last_touch``: there is none; ``reference_outdated``: the tool was
            changed since.
    """
    kept = controller.outcomes.recorded(tool=tool, kinds=KEPT)
    newest = next(
        (found for found in (_last_touch(entry, station) for entry in kept) if found), None
    )
    if newest is None:
        raise CalibrationError(
            "no_last_touch",
            tr(
                "Tool {tool} was never calibrated on station {station}.", tool=tool, station=station
            ),
            remedy=tr(
                "Make a full calibration there first: robolink calibrate n-angle --tool {tool} "
                "--station {station}",
                tool=tool,
                station=station,
            ),
        )
    stored = controller.tools.read(tool)
    if not controller.tools.same(stored, newest.value):
        raise CalibrationError(
            "reference_outdated",
            tr(
                "Tool {tool} holds {stored}; its last touch at {station} of {at} stands for "
                "{value}.",
                tool=tool,
                stored=describe_offset(stored),
                station=station,
                at=newest.at,
                value=describe_offset(newest.value),
            ),
            remedy=tr(
                "Somebody changed the tool since. Put that value back, or make a full calibration."
            ),
        )
    return newest


def _last_touch(entry: Recorded, station: str) -> LastTouch | None:
    said, value = entry.details.get("touch"), read_offset(entry.details.get("value"))
    if not isinstance(said, Mapping) or said.get("station") != station or value is None:
        return None
    sigma_mm = said["touch_sigma_mm"]
    return LastTouch(
        station=station,
        place_mm=(float(said["x_mm"]), float(said["y_mm"]), float(said["z_mm"])),
        u_deg=float(said["u_deg"]),
        value=value,
        chain=NeedleChain(float(said["sigma_mm"]), int(said["changes"])),
        touch_sigma_mm=None if sigma_mm is None else float(sigma_mm),
        nozzle=entry.signature.nozzle,
        at=entry.at,
    )
