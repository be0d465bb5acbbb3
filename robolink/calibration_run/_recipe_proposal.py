"""What a recipe proposes from a measurement: the basis, where Z comes from, the reference.

The reference of a difference is where the tip was when the stored offset was right. Taught points
are consistent only with the tool value that they were taught with, even when that value does not
say where the tip really is. So with basis "difference" the measured tip is not written; the stored
offset is moved by how much the tip moved since the reference, and what was wrong with it stays as
it was.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from statistics import fmean
from typing import TYPE_CHECKING

from robolink.calibration_run._proposal import Proposal
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import (
    Controller,
    EntryKind,
    Recorded,
    ToolOffset,
    angle_difference_deg,
    describe_offset,
    plain_offset,
    read_offset,
    rotate_xy,
)
from robolink.timing import local_label
from robolink.ways import Way, way

if TYPE_CHECKING:
    from robolink.recipe import Recipe

_KINDS = (EntryKind.CALIBRATION, EntryKind.DONE, EntryKind.DECISION)


@dataclass(frozen=True, slots=True)
class Reference:
    """A tip that was measured, and the offset that stood for it.

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
    """Return what an entry has to say to serve as a reference later."""
    return {
        "reference": station,
        "tip": plain_offset(tip),
        "value": plain_offset(value),
        "contact_z_mm": contact_z_mm,
    }


def find_reference(controller: Controller, tool: int, station: str) -> Reference | None:
    """Return the newest reference of a tool at a station, if it stands for what is stored.

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
            "The tool is not what the reference left. Put the value of the reference back, "
            "or take a new reference with {reference} and the nozzle for which the stored "
            "value is right.",
            reference=way(Way.REFERENCE),
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
    from robolink.calibration import ZTouchResult  # numpy, late

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
    """Return the proposal that the recipe makes of a bare measurement.

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
        # A height that a touch tells is compared below.
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
    """Return the value of the reference, carried along by the tip as if it were fixed to it.

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
    """Return Z of the tip: the flange stands the higher at the contact, the longer the tip."""
    if recipe.basis == "absolute":
        assert recipe.station.z_mm is not None  # noqa: S101 - the recipe was checked
        return recipe.station.z_mm - height
    if reference is None:
        return offset.z_mm
    if reference.contact_z_mm is None:
        raise CalibrationError(
            "reference_outdated",
            tr(
                "The reference of {at} does not say how high the contact was.",
                at=local_label(reference.at),
            ),
            remedy=tr("Take a new reference with {reference}.", reference=way(Way.REFERENCE)),
        )
    return offset.z_mm - (height - reference.contact_z_mm)


def _record(recipe: "Recipe", reference: Reference | None) -> dict[str, object]:
    record: dict[str, object] = {"basis": recipe.basis, "z": recipe.z}
    if recipe.basis == "difference":
        # Whatever was wrong with Z stays wrong by as much: no pin's height is learnt from it.
        record["z_from"] = "kept"
    if reference is not None:
        record["reference_entry"] = reference.number
    return record
