"""Whether the pin is where it was: tells a bumped pin from new nozzles."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from robolink.calibration import StationShift, TipShift, judge_shifts
from robolink.calibration_run._plan import Proposals, ToolPlan
from robolink.calibration_run._proposal import Proposal
from robolink.calibration_run._records import finds_pin, found_pin
from robolink.calibration_run._repeatability import Seating, nozzle_in, seating_of
from robolink.errors import CalibrationError
from robolink.messages import in_english, tr
from robolink.methods import KEPT
from robolink.model import Controller, EntryKind, NewEntry
from robolink.package_log import PackageLog
from robolink.procedures import FindsStation
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.stations import Station, base_now, find_stations, station_entry, stations_on_record

_LOG: Final = PackageLog(__package__)


def check_stations(controller: Controller, proposals: Proposals) -> Proposals:
    """Return the proposals, with a doubt if the pin has moved since it was found.

    A full calibration finds the pin anew, so its tip is right wherever the pin is now. One touch
    relies on the pin: where several tips say together that it moved, nothing is proposed. A single
    one is doubted, because its nozzle may sit otherwise than any before; the proof about the new
    tip, half a turn on, shows an error twofold.

    Raises:
        CalibrationError: ``station_moved``.
    """
    if not any(plan.pin for plan, _ in proposals):
        return proposals
    known = stations_on_record(controller)
    seating = seating_of(controller)
    judged = list(proposals)
    for name in dict.fromkeys(plan.pin for plan, _ in proposals if plan.pin):
        there = [proposal for plan, proposal in proposals if plan.pin == name]
        shifts = list(_shifts(controller, known.get(name), there, seating))
        shift = judge_shifts(shifts, seat_changes=seating.changes)
        if shift is None:
            continue
        relying = [one.tool for one in there if not finds_pin(one.result)]
        if shift.moved and len(relying) > 1:
            raise _refusal(controller.identity, name, shift)
        judged = [
            (plan, _judged(plan, proposal, shift) if plan.pin == name else proposal)
            for plan, proposal in judged
        ]
    return judged


def stations_found(controller: Controller, proposals: Proposals) -> Iterator[NewEntry]:
    """Yield what accepted calibrations show about places of pins and views of cameras."""
    known = stations_on_record(controller)
    base: tuple[float, ...] | None = None
    asked = False
    for plan, proposal in proposals:
        found = found_pin(plan.pin, proposal, known.get(plan.pin)) if plan.pin else None
        if isinstance(plan.source, FindsStation):
            found = plan.source.found_station(proposal.result, proposal.tool)
        if found is not None:
            if not asked:
                base, asked = base_now(controller), True
            yield station_entry(found, base=base)


def _shifts(
    controller: Controller,
    station: Station | None,
    proposals: Sequence[Proposal],
    seating: Seating,
) -> Iterator[TipShift]:
    several = len(proposals) > 1
    for proposal in proposals:
        if finds_pin(proposal.result):
            shift = _measured_shift(station, proposal)
        else:
            seat = () if _same_nozzle(controller, proposal) else seating.sigma_mm
            shift = _supposed_shift(proposal, seat)
            if shift is not None and seat and not several:
                # With one tool, a lower pin and a longer tip look the same.
                shift = replace(shift, vector_mm=shift.vector_mm[:2], seat_sigma_mm=seat[:2])
        if shift is not None:
            yield shift


def _measured_shift(station: Station | None, proposal: Proposal) -> TipShift | None:
    """Return how far a full calibration found the pin from before; the tip plays no part."""
    found = found_pin(station.id, proposal) if station else None
    if found is None or station is None or station.x_mm is None or station.y_mm is None:
        return None
    if found.x_mm is None or found.y_mm is None or not found.sigma_mm or not station.sigma_mm:
        return None
    vector = (found.x_mm - station.x_mm, found.y_mm - station.y_mm)
    # Both places have their stated uncertainties; a shift has the variance of two touches.
    sigma_mm = math.hypot(found.sigma_mm, station.sigma_mm) / math.sqrt(2)
    return TipShift(proposal.tool, vector, sigma_mm)


def _supposed_shift(proposal: Proposal, seat_mm: tuple[float, ...]) -> TipShift | None:
    """Return by how much the pin would have moved if the tip had not."""
    from robolink.calibration import rotation_of  # numpy, imported late

    before, after, result = proposal.before, proposal.tip, proposal.result
    if before is None or not result.sigma_mm:
        return None
    rows = rotation_of(result.inputs[0]).tolist()
    moved = [b - a for a, b in zip(after.components()[:3], before.components()[:3], strict=True)]
    vector = tuple(sum(r * m for r, m in zip(row, moved, strict=True)) for row in rows)
    return TipShift(proposal.tool, vector, result.sigma_mm, seat_mm)


def _same_nozzle(controller: Controller, proposal: Proposal) -> bool:
    """Return whether the nozzle is known to be the one measured last."""
    outcomes = controller.outcomes
    kept = outcomes.recorded(tool=proposal.tool, kinds=KEPT)
    # An answer to a question is a decision too, but contains no value.
    last = next((entry for entry in kept if "value" in entry.details), None)
    if last is None:
        return False
    now = nozzle_in(proposal.kept_record, outcomes.signature.nozzle)
    return bool(now) and now == nozzle_in(last.details, last.signature.nozzle)


def _judged(plan: ToolPlan, proposal: Proposal, shift: StationShift) -> Proposal:
    """Return a proposal with the doubts that the shift causes."""
    if shift.moved:
        record = {**proposal.record, "station_shift_mm": list(shift.vector_mm)}
        doubted = _with(proposal, _sentence(plan.pin, shift), doubt="station_moved")
        return replace(doubted, record=record)
    if finds_pin(proposal.result) or not shift.undecided(plan.criteria.drift_tolerance_mm):
        return proposal
    said = tr(
        "Station {station} may have moved by up to {detectable:.2f} mm: with this "
        "many new nozzles, a smaller shift would not show.",
        station=plan.pin,
        detectable=shift.detectable_mm,
    )
    if plan.verify and plan.moving:
        # The turn test about the new tip decides, so there is nothing to doubt yet.
        return replace(
            proposal,
            result=replace(proposal.result, notes=(*proposal.result.notes, "station_undecided")),
        )
    return _with(proposal, said, doubt="station_undecided")


def _with(proposal: Proposal, sentence: str, *, doubt: str) -> Proposal:
    result = proposal.result
    return replace(
        proposal,
        result=replace(result, warnings=(*result.warnings, doubt)),
        notes=(*proposal.notes, sentence),
    )


def _refusal(identity: str, station: str, shift: StationShift) -> CalibrationError:
    _LOG.decided(in_english(_sentence(station, shift)), controller=identity)
    return CalibrationError(
        "station_moved",
        tr(
            "Pin {station} seems to have moved {mm:.3f} mm, as tools {tools} show.",
            station=station,
            mm=math.hypot(*shift.vector_mm[:2]),
            tools=", ".join(map(str, shift.tools)),
        )
        if len(shift.tools) > 1
        else tr(
            "Pin {station} seems to have moved {mm:.3f} mm, as tool {tool} shows.",
            station=station,
            mm=math.hypot(*shift.vector_mm[:2]),
            tool=shift.tools[0],
        ),
        remedy=tr(
            "Nothing was written. Fasten the pin, find it again with a full calibration "
            "({calibrate}), then touch it with each tool.",
            calibrate=remedy_word(RemedyWord.CALIBRATE_AT, station=station),
        ),
    )


def _sentence(station: str, shift: StationShift) -> str:
    dx, dy = shift.vector_mm[:2]
    if len(shift.tools) > 1:
        return tr(
            "Pin {station} seems to have moved by X {dx:+.3f} Y {dy:+.3f} mm: tools {tools} "
            "shifted alike, by more than new nozzles explain.",
            tools=", ".join(map(str, shift.tools)),
            dx=dx,
            dy=dy,
            station=station,
        )
    return tr(
        "Pin {station} seems to have moved by X {dx:+.3f} Y {dy:+.3f} mm since it was last "
        "found: the nozzle of tool {tool} does not explain it.",
        station=station,
        dx=dx,
        dy=dy,
        tool=shift.tools[0],
    )


def found_with(controller: Controller, tools: Sequence[int]) -> dict[int, tuple[str, ...]]:
    """Return the recorded stations that were found with each of some tools."""
    entries = list(controller.outcomes.recorded(kinds=(EntryKind.STATION,)))
    found = find_stations(None, entries).values()
    finders = {entry.number: entry.tool for entry in entries}
    by = {one.id: finders.get(one.entry) for one in found if one.entry is not None}
    return {tool: tuple(sorted(name for name, of in by.items() if of == tool)) for tool in tools}
