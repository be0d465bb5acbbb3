"""The reference of a difference: where the tip was when the stored offset was right.

Taught points are consistent only with the tool value that they were taught with, even when
that value does not say where the tip really is. So with basis "difference" the measured tip
is not written; the stored offset is moved by how much the tip moved since the reference, and
what was wrong with it stays as it was.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import (
    Controller,
    EntryKind,
    Recorded,
    ToolOffset,
    describe_offset,
    plain_offset,
    read_offset,
)
from robolink.timing import local_label
from robolink.ways import Way, way

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
