"""Whether the journal says how well the stored Z of a tool is known.

The stored value is traced back through what was kept: a calibration that left Z as it was, and
differences that were added to it, down to the measurement of Z itself. Whatever else wrote Z, such
as a typed value, ends the trace: then nothing is known of it.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.calibration import NORMAL_95, StoredZ
from robolink.methods.one_touch.last_touch import KEPT
from robolink.model import Controller, EntryKind, Recorded, ToolOffset, read_offset

_SAME_MM: Final = 0.001
"""Within this a value that was read back is the one that was written: EPSON keeps 0.001 mm."""


@dataclass(slots=True)
class _Trace:
    """Where the trace has got to.

    Attributes:
        z_mm: The value whose origin is looked for.
        added_mm2: Square of half the interval of what was added to it since, mm^2.
        nozzle: Id of the nozzle whose Z it is, empty for one that nobody named.
    """

    z_mm: float
    added_mm2: float = 0.0
    nozzle: str = ""


def find_stored_z(controller: Controller, tool: int, stored: ToolOffset) -> StoredZ:
    """Return the stored Z of a tool, with the measurement on record that it goes back to.

    Args:
        controller: The controller, connected; its record is looked at.
        tool: Number of the tool.
        stored: What it holds.

    Raises:
        ConfigError: The record cannot be read.

    Example:
        >>> from robolink.methods.one_touch.stored_z import find_stored_z
        >>> from robolink.model import ToolOffset
        >>> from robolink.testing import MemoryController
        >>> find_stored_z(MemoryController(), 1, ToolOffset(12, -4, -20)).on_record
        False
    """
    kinds = (*KEPT, EntryKind.CALIBRATION)
    return traced(controller.outcomes.recorded(tool=tool, kinds=kinds), stored)


def traced(entries: Iterable[Recorded], stored: ToolOffset) -> StoredZ:
    """Return the same from the entries of the tool, the newest first."""
    unknown, trace = StoredZ(stored.z_mm), _Trace(stored.z_mm)
    kept: Recorded | None = None
    for entry in entries:
        if entry.kind is EntryKind.CALIBRATION:
            # A measurement stands before the entry that kept its value; others were not kept.
            if kept is None or kept.change != entry.change:
                continue
            found = _measured(trace, kept, entry)
            if found is not None:
                half_mm, number = found
                return StoredZ(stored.z_mm, math.sqrt(half_mm**2 + trace.added_mm2), number)
            if not _goes_on(trace, kept, entry):
                return unknown
            kept = None
            continue
        value = read_offset(entry.details.get("value"))
        if value is None or (kept is not None and kept.change == entry.change):
            continue
        if kept is not None or abs(value.z_mm - trace.z_mm) > _SAME_MM:
            return unknown
        if "method" in entry.details:
            kept = entry
        elif not _left_z(entry, trace.z_mm):
            return unknown
    return unknown


def _measured(trace: _Trace, kept: Recorded, calibration: Recorded) -> tuple[float, int] | None:
    """Return half the interval that a calibration gave Z, and the entry; ``None`` for none."""
    said = calibration.details
    measured, halves = said.get("measured"), said.get("half_width95")
    if kept.details.get("z_from") != "measured" or not isinstance(measured, Sequence):
        return None
    if "z_mm" not in measured or not isinstance(halves, Sequence) or not halves:
        return None
    if trace.nozzle and _nozzle(kept) != trace.nozzle:
        return None  # of another needle than the one that is stored
    value, tip = read_offset(kept.details.get("value")), read_offset(kept.details.get("tip"))
    if value is None or tip is None or abs(value.z_mm - tip.z_mm) > _SAME_MM:
        return None  # what was written is not where the tip was found
    earlier, half_mm = said.get("stored_z"), float(halves[list(measured).index("z_mm")])
    if isinstance(earlier, Mapping) and isinstance(earlier.get("half95_mm"), float):
        # Touches between cancel, so that differences do not add up: it goes back to the start.
        return float(earlier["half95_mm"]), int(earlier["entry"])
    return half_mm, calibration.number


def _goes_on(trace: _Trace, kept: Recorded, calibration: Recorded) -> bool:
    """Take a trace on past a calibration in which Z was not measured; False where it ends there.

    A Z that was kept is that of the needle before: it holds for the new one where the heights of
    the touches said so, or where it is the same needle.
    """
    details, before = kept.details, read_offset(kept.details.get("before"))
    changed = calibration.details.get("changed")
    if before is None or (isinstance(changed, Sequence) and "z_mm" in changed):
        return False
    length, checked = details.get("length"), details.get("length_checked")
    nozzle = _nozzle(kept)
    same = bool(nozzle) and nozzle == (trace.nozzle or nozzle)
    follows = details.get("z_from") == "measured"
    said = length if isinstance(length, Mapping) else checked
    if abs(before.z_mm - trace.z_mm) > _SAME_MM and not (follows and length):
        return False
    if follows and isinstance(said, Mapping):
        trace.added_mm2 += (NORMAL_95 * float(said["u_mm"])) ** 2
    elif not same:
        return False
    trace.z_mm, trace.nozzle = before.z_mm, "" if follows else nozzle
    return True


def _nozzle(kept: Recorded) -> str:
    return str(kept.details.get("nozzle") or kept.signature.nozzle)


def _left_z(entry: Recorded, z_mm: float) -> bool:
    before = read_offset(entry.details.get("before"))
    return before is not None and abs(before.z_mm - z_mm) <= _SAME_MM
