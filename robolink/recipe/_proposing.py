"""What is proposed from a measurement: the basis, and where Z comes from."""

from collections.abc import Collection
from dataclasses import replace
from statistics import fmean

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import ToolOffset, angle_difference_deg, rotate_xy
from robolink.nozzle_change import Proposal
from robolink.recipe._reference import Reference, reference_details
from robolink.recipe.file.recipe import Recipe
from robolink.timing import local_label
from robolink.ways import Way, way


def contact_z_mm(proposal: Proposal) -> float:
    """Return the height of the flange when the tip touched, mean of all touches, mm."""
    from robolink.calibration import ZTouchResult  # numpy, late

    result = proposal.result
    if isinstance(result, ZTouchResult):
        return result.flange_z_mm
    return fmean(pose.z_mm for pose in result.inputs)


def proposed(
    recipe: Recipe,
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
    recipe: Recipe, offset: ToolOffset, height: float, reference: Reference | None
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


def _record(recipe: Recipe, reference: Reference | None) -> dict[str, object]:
    record: dict[str, object] = {"basis": recipe.basis, "z": recipe.z}
    if recipe.basis == "difference":
        # Whatever was wrong with Z stays wrong by as much: no pin's height is learnt from it.
        record["z_from"] = "kept"
    if reference is not None:
        record["reference_entry"] = reference.number
    return record
