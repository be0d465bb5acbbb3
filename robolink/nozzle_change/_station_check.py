"""Whether the pin is where it was: a pin that was bumped is told from tips that moved."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from robolink.calibration import StationShift, TipShift, judge_shifts
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods import KEPT
from robolink.model import Controller, EntryKind, NewEntry, rotate_xy
from robolink.nozzle_change._pin_record import finds_pin, found_pin
from robolink.nozzle_change._plan import ToolPlan
from robolink.nozzle_change._proposal import Proposal
from robolink.procedures import FindsStation
from robolink.stations import Station, find_stations, station_entry
from robolink.ways import Way, way

Proposals = Sequence[tuple[ToolPlan, Proposal]]


def check_stations(controller: Controller, proposals: Proposals) -> Proposals:
    """Return the proposals, doubted where the pin moved since it was found.

    A full calibration finds the pin anew, so its tip is right wherever the pin is now. One touch
    relies on the pin: where several tips moved by the same vector, nothing is proposed.

    Raises:
        CalibrationError: ``station_moved``.
    """
    if not any(plan.pin for plan, _ in proposals):
        return proposals
    known = find_stations(None, controller.outcomes.recorded(kinds=(EntryKind.STATION,)))
    judged = list(proposals)
    for name in dict.fromkeys(plan.pin for plan, _ in proposals if plan.pin):
        there = [proposal for plan, proposal in proposals if plan.pin == name]
        shift = judge_shifts(list(_shifts(controller, known.get(name), there)))
        if shift is None or not shift.moved:
            continue
        relying = [one.tool for one in there if not finds_pin(one.result)]
        if len(relying) > 1:
            raise _refusal(name, shift)
        judged = [
            (plan, _doubted(proposal, name, shift) if plan.pin == name else proposal)
            for plan, proposal in judged
        ]
    return judged


def stations_found(proposals: Proposals) -> Iterator[NewEntry]:
    """Yield what calibrations that were kept say about where pins are, and how cameras see."""
    for plan, proposal in proposals:
        found = found_pin(plan.pin, proposal) if plan.pin else None
        if isinstance(plan.source, FindsStation):
            found = plan.source.found_station(proposal.result, proposal.tool)
        if found is not None:
            yield station_entry(found)


def _shifts(
    controller: Controller, station: Station | None, proposals: Sequence[Proposal]
) -> Iterator[TipShift]:
    for proposal in proposals:
        if finds_pin(proposal.result):
            shift = _measured_shift(station, proposal)
        else:
            shift = _supposed_shift(controller, proposal)
        if shift is not None:
            yield shift


def _measured_shift(station: Station | None, proposal: Proposal) -> TipShift | None:
    """Return by how much a full calibration found the pin elsewhere; the tip plays no part."""
    found = found_pin(station.id, proposal) if station else None
    if found is None or station is None or station.x_mm is None or station.y_mm is None:
        return None
    if found.x_mm is None or found.y_mm is None or not found.sigma_mm or not station.sigma_mm:
        return None
    vector = (found.x_mm - station.x_mm, found.y_mm - station.y_mm)
    sigma_mm = math.hypot(found.sigma_mm, station.sigma_mm)
    return TipShift(proposal.tool, vector, sigma_mm, same_tip=True)


def _supposed_shift(controller: Controller, proposal: Proposal) -> TipShift | None:
    """Return by how much the pin would have moved if the tip had not."""
    before, after, result = proposal.before, proposal.tip, proposal.result
    if before is None or not result.sigma_mm:
        return None
    dx, dy = rotate_xy(after.x_mm - before.x_mm, after.y_mm - before.y_mm, result.inputs[0].u_deg)
    return TipShift(
        proposal.tool,
        (-dx, -dy, before.z_mm - after.z_mm),
        math.sqrt(2) * result.sigma_mm,
        same_tip=_same_nozzle(controller, proposal),
    )


def _same_nozzle(controller: Controller, proposal: Proposal) -> bool:
    """Tell whether the nozzle is known to be the one that was measured last."""
    outcomes = controller.outcomes
    kept = outcomes.recorded(tool=proposal.tool, kinds=KEPT)
    # An answer to a question is a decision too, and stands for no value.
    last = next((entry for entry in kept if "value" in entry.details), None)
    if last is None:
        return False
    now = _nozzle(proposal.kept_record, outcomes.signature.nozzle)
    return bool(now) and now == _nozzle(last.details, last.signature.nozzle)


def _nozzle(details: Mapping[str, object], of_the_run: str) -> str:
    own = details.get("nozzle")
    return own if isinstance(own, str) and own else of_the_run


def _doubted(proposal: Proposal, station: str, shift: StationShift) -> Proposal:
    result = proposal.result
    return replace(
        proposal,
        result=replace(result, warnings=(*result.warnings, "station_moved")),
        notes=(*proposal.notes, _sentence(station, shift)),
        record={**proposal.record, "station_shift_mm": list(shift.vector_mm)},
    )


def _refusal(station: str, shift: StationShift) -> CalibrationError:
    return CalibrationError(
        "station_moved",
        _sentence(station, shift),
        remedy=tr(
            "Nothing was written. Fasten the pin, find it again with a full calibration "
            "({calibrate}), then touch it with each tool.",
            calibrate=way(Way.CALIBRATE_AT, station=station),
        ),
    )


def _sentence(station: str, shift: StationShift) -> str:
    dx, dy = shift.vector_mm[:2]
    if len(shift.tools) > 1:
        said = tr(
            "Tools {tools} all shifted by X {dx:+.3f} Y {dy:+.3f} mm at station {station}: the "
            "station moved, not the tips",
            tools=", ".join(map(str, shift.tools)),
            dx=dx,
            dy=dy,
            station=station,
        )
    else:
        said = tr(
            "Station {station} shifted by X {dx:+.3f} Y {dy:+.3f} mm since it was found last, and "
            "the nozzle of tool {tool} does not explain it: the station moved",
            station=station,
            dx=dx,
            dy=dy,
            tool=shift.tools[0],
        )
    sure = tr(
        "(chi-square {together:.0f}; chance stays below {limit:.0f})",
        together=shift.together,
        limit=shift.together_limit,
    )
    return f"{said} {sure}."
