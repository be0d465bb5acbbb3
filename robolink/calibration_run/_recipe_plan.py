"""The plan that a recipe asks for, and the proposal that it makes afterwards.

The reference of a difference is where the tip was when the stored offset was right. Taught points
are consistent only with the tool value that they were taught with, even when that value does not
say where the tip really is. So with basis "difference" the measured tip is not written; the stored
offset is moved by how much the tip moved since the reference, and what was wrong with it stays as
it was.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING

from robolink.accuracy import stated_rows
from robolink.calibration_run._acceptance import AcceptanceCriteria
from robolink.calibration_run._plan import ChangePlan, Limits, ToolPlan
from robolink.calibration_run._proposal import Proposal
from robolink.config import Cell
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.methods import MethodParameters, Site, source_of
from robolink.model import (
    AnsweredBy,
    Controller,
    EntryKind,
    Recorded,
    TipSensor,
    ToolOffset,
    angle_difference_deg,
    describe_offset,
    plain_offset,
    read_offset,
    rotate_xy,
)
from robolink.pose_tables import ReadingChoices
from robolink.procedures import TipSource
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.stations import Station, StationKind
from robolink.timing import local_label

if TYPE_CHECKING:
    from robolink.recipe import Recipe, Tool


def plan_of(
    recipe: "Recipe",
    station: Station,
    controller: Controller,
    *,
    folder: Path,
    ask_before_write: bool = True,
    agreed_by: AnsweredBy = AnsweredBy.PROGRAM,
    accepted_change_mm: float | None = None,
    sensor: str | TipSensor | None = None,
    stated: Station | None = None,
    cell: Cell | None = None,
) -> ChangePlan:
    """Return a recipe's plan for one controller.

    Args:
        recipe: The recipe.
        station: Its station, with what its record adds.
        controller: The controller; only read, and only where the robot has to tilt.
        folder: Where the recipe lies: files that it names are looked for there.
        ask_before_write: Whether a person accepts the proposals.
        agreed_by: How the write was agreed to in advance, where nobody is asked.
        accepted_change_mm: A larger jump than the recipe's that an engineer accepts this time.
        sensor: The camera, or its name or URL, in place of the recipe's.
        stated: The station as the cell file has it, ``None`` where it says nothing.
        cell: The cell, whose file may state rows of the budget.

    Raises:
        CalibrationError: ``rank_deficient``: this robot cannot tilt its tool.
        ConfigError: This kind of controller has no taught points, or no camera is named.
    """
    tolerances, parameters = recipe.tolerances, recipe.parameters
    criteria = AcceptanceCriteria(
        max_change_mm=tolerances.jump_mm,
        rms_mm=tolerances.rms_mm,
        max_residual_mm=tolerances.max_mm,
        interval_mm=tolerances.interval_mm,
        drift_tolerance_mm=tolerances.drift_mm,
        accepted_change_mm=accepted_change_mm,
        accepted_with=remedy_word(RemedyWord.ACCEPT_JUMP),
        unattended=not ask_before_write,
        stated=frozenset(("rms_mm", "max_residual_mm", "interval_mm")),
    )
    rows = stated_rows(cell, station, recipe=recipe.accuracy.stated, recipe_name=recipe.name)
    safe, needs = recipe.poses.safe, recipe.source.of_method.needs
    return ChangePlan(
        tuple(
            ToolPlan(
                tool.number,
                _source(
                    recipe,
                    parameters,
                    station=station,
                    controller=controller,
                    tool=tool,
                    sensor=sensor,
                    folder=folder,
                ),
                criteria,
                verify=recipe.verifies,
                attempts=recipe.attempts,
                approach=tool.approach.pose if tool.approach else None,
                retreat=tool.retreat.pose if tool.retreat else None,
                pin=_pin(recipe),
                stated_pin=stated if _pin(recipe) else None,
                gauge=station.gauge_on_record(),
                length=parameters.length_rule(),
                method=recipe.source.of_method.name,
                station="" if needs.finds_pin or not station.learnt else station.id,
                at=station.id,
                rows=rows,
            )
            for tool in recipe.tools
        ),
        limits=_limits(recipe, parameters),
        ask_before_write=ask_before_write,
        agreed_by=agreed_by,
        safe=safe.pose if safe else None,
        turn_back=recipe.poses.turn_back,
    )


def _source(
    recipe: "Recipe",
    parameters: MethodParameters,
    *,
    station: Station,
    controller: Controller,
    tool: "Tool",
    sensor: str | TipSensor | None,
    folder: Path,
) -> TipSource:
    tolerances = recipe.tolerances
    site = Site(
        controller=controller,
        tool=tool.number,
        station=station,
        points=tool.points or (),
        pose_file=_pose_file(tool, folder),
        sigma_mm=tolerances.sigma_mm,
        max_change_mm=tolerances.jump_mm,
        interval_mm=tolerances.interval_mm,
        sensor=sensor,
    )
    return source_of(recipe.source.of_method, parameters, site)


def _pose_file(tool: "Tool", folder: Path) -> tuple[Path, ReadingChoices] | None:
    given = tool.poses
    if given is None:
        return None
    return folder / given.file, ReadingChoices(given.columns, given.length, given.euler)


def _pin(recipe: "Recipe") -> str:
    """Return the name of the pin whose place is kept, empty if none is touched."""
    needs = recipe.source.of_method.needs
    return recipe.station.id if needs.motion and needs.station is StationKind.PIN else ""


def _limits(recipe: "Recipe", parameters: MethodParameters) -> Limits:
    """Return where the robot may go; higher if the method needs it and nobody said how high."""
    box, speeds = recipe.box, recipe.speeds
    higher_mm = 0.0 if "up_mm" in box.model_fields_set else parameters.height_mm()
    return Limits(
        box.reach.larger(up_mm=higher_mm),
        speed_percent=speeds.percent,
        speed_mm_s=speeds.mm_s,
    )


def located(recipe: "Recipe", stations: Mapping[str, Station]) -> tuple["Recipe", Station]:
    """Return the recipe with its station's place, and the station as the method sees it.

    What the recipe says goes before the record.

    Args:
        recipe: The recipe.
        stations: The stations of the cell, by name.

    Raises:
        ConfigError: Something about the station is needed that neither recipe nor record says.
    """
    place, needs = recipe.station, recipe.source.of_method.needs
    if place.z_mm is None and _place_needed(recipe):
        known = _known(recipe, stations)
        recipe = _with_place(recipe, known)
    elif _record_needed(recipe) or (needs.sensor and place.id in stations):
        known = _known(recipe, stations)
    else:
        recorded = stations.get(place.id)
        fits = recorded is not None and recorded.kind is needs.station and needs.place is not None
        known = recorded if recorded and fits else Station(id=place.id, kind=needs.station)
        if recorded is not None and not fits:
            # The method does not use the place; the gauge at that place is recorded.
            known = replace(known, gauge=recorded.gauge, gauge_due=recorded.gauge_due)
    return recipe, _as_told(recipe, known)


def _place_needed(recipe: "Recipe") -> bool:
    method = recipe.source.of_method
    if method.needs.place is not None:
        return True
    measured = method.tells_height and recipe.z == "measured"
    return recipe.basis == "absolute" and (measured or not method.by_reference)


def _record_needed(recipe: "Recipe") -> bool:
    needs = recipe.source.of_method.needs
    known_otherwise = needs.station is StationKind.PIN or needs.place is not None
    return not known_otherwise and not recipe.source.parameters.states_station()


def _with_place(recipe: "Recipe", station: Station) -> "Recipe":
    place = {"x_mm": station.x_mm, "y_mm": station.y_mm, "z_mm": station.z_mm}
    if None in place.values():
        raise _unknown(recipe, tr("Its place is not known."))
    given = {**place, "sigma_mm": station.sigma_mm}
    return recipe.model_copy(update={"station": recipe.station.model_copy(update=given)})


def _as_told(recipe: "Recipe", station: Station) -> Station:
    place = recipe.station
    if place.z_mm is None or recipe.source.of_method.needs.station is StationKind.BEAMS:
        return station
    return station.at(place.x_mm, place.y_mm, place.z_mm, sigma_mm=place.sigma_mm)


def _known(recipe: "Recipe", stations: Mapping[str, Station]) -> Station:
    kind = recipe.source.of_method.needs.station
    station = stations.get(recipe.station.id)
    if station is None:
        raise _unknown(recipe, tr("No station of that name is known."))
    if station.kind is not kind:
        raise _unknown(
            recipe, tr("It is of kind {kind}, not {wanted}.", kind=station.kind, wanted=kind)
        )
    return station


def _unknown(recipe: "Recipe", why: str) -> ConfigError:
    return ConfigError(
        tr("The recipe does not say where {id} is. {why}", id=recipe.station.id, why=why),
        remedy=tr(
            "Nothing moved. State it in the recipe or in the cell file, learn it with "
            "'robolink cell station learn', or run a full calibration there."
        ),
    )


_KINDS = (EntryKind.CALIBRATION, EntryKind.DONE, EntryKind.DECISION)


@dataclass(frozen=True, slots=True)
class Reference:
    """A measured tip, and the offset that was stored for it.

    Attributes:
        tip: Where the tip was found.
        value: What was stored for it.
        contact_z_mm: Height of the flange when the tip touched the pin, where it was touched.
        at: When, as a label.
        number: Number of the entry.
    """

    tip: ToolOffset
    value: ToolOffset
    contact_z_mm: float | None
    at: str
    number: int


def reference_details(
    station: str, tip: ToolOffset, value: ToolOffset, contact_z_mm: float | None
) -> dict[str, object]:
    """Return what an entry must contain to serve as a reference later."""
    return {
        "reference": station,
        "tip": plain_offset(tip),
        "value": plain_offset(value),
        "contact_z_mm": contact_z_mm,
    }


def find_reference(controller: Controller, tool: int, station: str) -> Reference | None:
    """Return the newest reference of a tool at a station, if it matches the stored value.

    Returns:
        ``None`` when there never was one.

    Raises:
        CalibrationError: ``reference_outdated``: the tool was changed since.
    """
    newest = None
    for entry in controller.outcomes.recorded(tool=tool, kinds=_KINDS):
        newest = _reference(entry, station)
        if newest is not None:
            break
    if newest is None:
        return None
    stored = controller.tools.read(tool)
    if controller.tools.same(stored, newest.value):
        return newest
    raise CalibrationError(
        "reference_outdated",
        tr(
            "Tool {tool} holds {stored}; its reference at {station}, of {at}, belongs to {value}.",
            tool=tool,
            stored=describe_offset(stored),
            station=station,
            at=local_label(newest.at),
            value=describe_offset(newest.value),
        ),
        remedy=tr(
            "Write that value back, or record a new reference with {reference}.",
            reference=remedy_word(RemedyWord.REFERENCE),
        ),
    )


def _reference(entry: Recorded, station: str) -> Reference | None:
    details: Mapping[str, object] = entry.details
    if details.get("reference") != station:
        return None
    tip, value = read_offset(details.get("tip")), read_offset(details.get("value"))
    height = details.get("contact_z_mm")
    if tip is None or value is None:
        return None
    return Reference(
        tip, value, height if isinstance(height, float) else None, entry.at, entry.number
    )


def contact_z_mm(proposal: Proposal) -> float:
    """Return the height of the flange when the tip touched, mean of all touches, mm."""
    from robolink.calibration import ZTouchResult  # numpy, imported late

    result = proposal.result
    if isinstance(result, ZTouchResult):
        return result.flange_z_mm
    return fmean(pose.z_mm for pose in result.inputs)


def proposed(
    recipe: "Recipe",
    measured: Proposal,
    *,
    reference: Reference | None,
    typed_z_mm: float | None = None,
    taking_reference: bool = False,
) -> Proposal:
    """Return the recipe's proposal from a bare measurement.

    Args:
        recipe: The recipe.
        measured: What was measured; its Z is the stored one.
        reference: The reference of basis "difference"; ``None`` while one is being taken.
        typed_z_mm: What the person typed, for z = "typed".
        taking_reference: Whether nothing will be written, and this is kept as the reference.
    """
    tip = measured.result.offset
    offset, notes = tip, list[str]()
    height = contact_z_mm(measured) if recipe.source.of_method.tells_height else None
    if recipe.basis == "difference" and reference is not None:
        # A height that a touch shows is compared below.
        shown = {name for name in measured.result.found if name != "z_mm" or height is None}
        offset = _moved(reference, tip, shown)
        notes.append(_as_moved(reference, offset, shown))
    if recipe.z == "typed" and typed_z_mm is not None:
        offset = replace(offset, z_mm=typed_z_mm)
        notes.append(tr("Z was typed"))
    elif recipe.z == "kept" and "z_mm" in measured.result.found:
        offset = replace(offset, z_mm=(measured.before or ToolOffset()).z_mm)
        notes.append(tr("Z was measured, and is kept as it was"))
    elif recipe.z == "measured" and height is not None:
        offset = replace(offset, z_mm=_height(recipe, offset, height, reference))
        notes.append(tr("Z was measured by touching"))
    station = recipe.station.id
    stored = measured.before or ToolOffset()
    return Proposal(
        measured.tool,
        measured.before,
        replace(measured.result, offset=offset),
        measured=None if offset == tip else tip,
        notes=tuple(notes),
        z_from=recipe.z,
        record=_record(recipe, reference)
        | (reference_details(station, tip, stored, height) if taking_reference else {}),
        kept_record=_record(recipe, reference) | reference_details(station, tip, offset, height),
        seating=measured.seating,
    )


def _moved(reference: Reference, tip: ToolOffset, shown: Collection[str]) -> ToolOffset:
    """Return the value of the reference, moved with the tip as if fixed to it.

    Args:
        reference: Where the tip was, and the value that stood for it.
        tip: Where it is.
        shown: The components that the measurement shows; Z and U move with these only.
    """
    value, before = reference.value, reference.tip
    turn_deg = angle_difference_deg(tip.u_deg, before.u_deg) if "u_deg" in shown else 0.0
    dx, dy = rotate_xy(value.x_mm - before.x_mm, value.y_mm - before.y_mm, turn_deg)
    return replace(
        value,
        x_mm=tip.x_mm + dx,
        y_mm=tip.y_mm + dy,
        z_mm=value.z_mm + (tip.z_mm - before.z_mm if "z_mm" in shown else 0.0),
        u_deg=value.u_deg + turn_deg,
    )


def _as_moved(reference: Reference, offset: ToolOffset, shown: Collection[str]) -> str:
    value, at = reference.value, local_label(reference.at)
    dx, dy = offset.x_mm - value.x_mm, offset.y_mm - value.y_mm
    if "u_deg" in shown:
        return tr(
            "the stored offset moved by X {dx:+.3f} Y {dy:+.3f} mm and turned by {du:+.3f} "
            "degrees, as the board did since {at}",
            dx=dx,
            dy=dy,
            du=offset.u_deg - value.u_deg,
            at=at,
        )
    if "z_mm" in shown:
        return tr(
            "the stored offset moved by X {dx:+.3f} Y {dy:+.3f} Z {dz:+.3f} mm, as the tip did "
            "since {at}",
            dx=dx,
            dy=dy,
            dz=offset.z_mm - value.z_mm,
            at=at,
        )
    return tr(
        "the stored offset moved by X {dx:+.3f} Y {dy:+.3f} mm, as the tip did since {at}",
        dx=dx,
        dy=dy,
        at=at,
    )


def _height(
    recipe: "Recipe", offset: ToolOffset, height: float, reference: Reference | None
) -> float:
    """Return Z of the tip: the longer the tip, the higher the flange at the contact."""
    if recipe.basis == "absolute":
        assert recipe.station.z_mm is not None  # noqa: S101 - the recipe was checked
        return recipe.station.z_mm - height
    if reference is None:
        return offset.z_mm
    if reference.contact_z_mm is None:
        raise CalibrationError(
            "reference_outdated",
            tr(
                "The reference of {at} has no contact height.",
                at=local_label(reference.at),
            ),
            remedy=tr(
                "Record a new reference with {reference}.",
                reference=remedy_word(RemedyWord.REFERENCE),
            ),
        )
    return offset.z_mm - (height - reference.contact_z_mm)


def _record(recipe: "Recipe", reference: Reference | None) -> dict[str, object]:
    record: dict[str, object] = {"basis": recipe.basis, "z": recipe.z}
    if recipe.basis == "difference":
        # An error in Z stays in a difference, so no pin's height is learnt from it.
        record["z_from"] = "kept"
    if reference is not None:
        record["reference_entry"] = reference.number
    return record
