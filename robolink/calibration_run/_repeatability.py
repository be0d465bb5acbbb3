"""Seating of nozzles, repeatability of touches, uncertainty of a tool: from a cell's records."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Final, Literal

from robolink.calibration import (
    PERSON_SIGMA_Z_MM,
    PROBE_SIGMA_Z_MM,
    f_quantile,
    seating_sentence,
)
from robolink.model import Controller, EntryKind, Pose, Recorded, ToolOffset, read_offset
from robolink.procedures import TouchPlan
from robolink.runner import TouchedAt

TouchWitness = Literal["person", "contact", "poses"]
"""What confirms touches: a person with a standoff, an input, or nothing but the poses."""

USUAL_SEAT_MM: Final = (0.1, 0.1, 0.05)
"""Standard deviation of X, Y and Z, in mm, while fewer changes are recorded; chosen, not measured.
"""

LEAST_CHANGES: Final = 8
"""Smallest number of changes that gives the scatter better than the usual value."""

LEAST_TOUCHES: Final = 10
"""Smallest number of touches, minus one per run, that shows a cell's scatter in height."""

MOST_CHANGES: Final = 50
"""Largest number of changes that are used: older ones say less about the present nozzles."""


@dataclass(frozen=True, slots=True)
class Seating:
    """How much the places of newly mounted nozzles differ.

    Attributes:
        sigma_mm: Standard deviation of X, Y and Z.
        changes: From how many changes it was pooled; ``None`` for the usual value.
    """

    sigma_mm: tuple[float, float, float] = USUAL_SEAT_MM
    changes: int | None = None

    @property
    def within_mm(self) -> float | None:
        """Distance in the plane within which the tip lies after the next mounting, in 95 %.

        ``None`` while too few changes are on record. Two coordinates that were pooled from n
        changes have 2 n degrees of freedom.
        """
        if self.changes is None:
            return None
        return math.sqrt(2 * f_quantile(0.95, 2, 2 * self.changes)) * self.sigma_mm[0]

    @property
    def sentence(self) -> str:
        """How far off the tip may be after the next mounting."""
        return seating_sentence(self.within_mm, self.changes)

    def as_json(self) -> dict[str, object]:
        """Return it as plain values; only ``None`` where the record does not show it."""
        return {"within_mm": self.within_mm, "changes": self.changes}


def seating_of(controller: Controller) -> Seating:
    """Return the seating by all tools' changes of a controller (docs/reference/evidence.md 11).

    X and Y are pooled: a nozzle has no side on which it sits better. Z counts where it was
    measured; a Z that was kept would look like a nozzle that always sits alike.
    """
    entries = controller.outcomes.recorded(kinds=(EntryKind.DONE, EntryKind.DECISION))
    changes = list(islice(_changes(entries), MOST_CHANGES))
    if len(changes) < LEAST_CHANGES:
        return Seating()
    plane = math.sqrt(sum(dx * dx + dy * dy for dx, dy, _ in changes) / (2 * len(changes)))
    heights = [dz for _, _, dz in changes if dz is not None]
    above = USUAL_SEAT_MM[2]
    if len(heights) >= LEAST_CHANGES:
        above = math.sqrt(sum(dz * dz for dz in heights) / len(heights))
    pooled = min(len(changes), len(heights) or len(changes))
    # With a scatter of zero, every touch would look like a moved pin.
    least = USUAL_SEAT_MM[2] / 10
    sigma = (max(plane, least), max(plane, least), max(above, least))
    return Seating(sigma, pooled)


def touched_by(poses: Sequence[Pose]) -> TouchWitness:
    """Return what confirmed touches: an input, the person who made them, or nobody."""
    touches = [pose for pose in poses if isinstance(pose, TouchedAt)]
    if len(touches) < len(poses) or any(touch.typed for touch in touches):
        return "poses"
    return "contact" if any(touch.contact is not None for touch in touches) else "person"


def touch_sigma_z_mm(controller: Controller, pin: str, by: TouchWitness = "person") -> float:
    """Return the standard deviation of the height of one touch of a pin.

    It is pooled within the runs on record once ten touches tell it; until then it is what is
    usual (docs/reference/evidence.md 1). Only touches that were made alike are pooled: an input
    repeats better than an eye, and poses that somebody typed may be rounded.

    Args:
        controller: Whose record is looked at.
        pin: Name of the pin; empty for one that nobody named, of which nothing is kept.
        by: What witnesses the touches.
    """
    usual_mm = PROBE_SIGMA_Z_MM if by == "contact" else PERSON_SIGMA_Z_MM
    if not pin:
        return usual_mm
    squares = freedom = 0.0
    for entry in controller.outcomes.recorded(kinds=(EntryKind.DONE, EntryKind.DECISION)):
        touch = entry.details.get("touch")
        if not isinstance(touch, Mapping) or touch.get("station") != pin:
            continue
        scatter, dof = touch.get("heights_mm2"), touch.get("heights_dof")
        alike = touch.get("heights_by") == by
        if alike and isinstance(scatter, (int, float)) and isinstance(dof, int) and dof > 0:
            squares, freedom = squares + scatter, freedom + dof
    if freedom < LEAST_TOUCHES:
        return usual_mm
    return max(math.sqrt(squares / freedom), PROBE_SIGMA_Z_MM)


def touching_as_recorded(controller: Controller, plan: TouchPlan, pin: str) -> TouchPlan:
    """Return a plan of touches with this cell's recorded repeatability, where none is stated.

    Args:
        controller: Whose record is looked at.
        plan: The plan; a standard deviation that it states stays.
        pin: Name of the pin, empty for none.

    Example:
        >>> from robolink.calibration_run import touching_as_recorded
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.controllers import SimpleController
        >>> controller = SimpleController()  # of whose record nothing is told
        >>> touching_as_recorded(controller, TouchPlan(), "PIN-07").sigma_z_mm is None
        False
        >>> touching_as_recorded(controller, TouchPlan(sigma_z_mm=0.004), "PIN-07").sigma_z_mm
        0.004
    """
    if plan.sigma_z_mm is not None:
        return plan
    by: TouchWitness = "person" if plan.contact is None else "contact"
    return replace(plan, sigma_z_mm=touch_sigma_z_mm(controller, pin, by))


def height_is_known(controller: Controller, tool: int) -> bool:
    """Return whether Z of a tool is more than a value that calibrations kept.

    Whoever wrote it by hand stands for it; a calibration of X and Y alone does not.
    """
    kept = controller.outcomes.recorded(tool=tool, kinds=(EntryKind.DONE, EntryKind.DECISION))
    newest = next((entry for entry in kept if "question" not in entry.details), None)
    return newest is None or newest.details.get("z_from") != "kept"


def tip_sigma_mm(controller: Controller, tool: int) -> float:
    """Return the uncertainty of a tool's stored tip by its last calibration, 0 for unknown."""
    kept = controller.outcomes.recorded(tool=tool, kinds=(EntryKind.DONE, EntryKind.DECISION))
    newest = next((entry for entry in kept if "question" not in entry.details), None)
    touch = newest.details.get("touch") if newest else None
    sigma = touch.get("sigma_mm") if isinstance(touch, Mapping) else None
    return float(sigma) if isinstance(sigma, (int, float)) else 0.0


def _changes(entries: Iterable[Recorded]) -> Iterator[tuple[float, float, float | None]]:
    """Yield by how much the tip of a tool differed from the one before, newest first."""
    later: dict[int, tuple[ToolOffset, Recorded]] = {}
    for entry in entries:
        tip = read_offset(entry.details.get("tip"))
        if entry.tool is None or tip is None or "touch" not in entry.details:
            continue
        if entry.tool in later:
            newer, of = later[entry.tool]
            if nozzle_of(of) != nozzle_of(entry) or not nozzle_of(of):
                measured = "measured" in (of.details.get("z_from"), entry.details.get("z_from"))
                both = of.details.get("z_from") == entry.details.get("z_from")
                dz = newer.z_mm - tip.z_mm if measured and both else None
                yield newer.x_mm - tip.x_mm, newer.y_mm - tip.y_mm, dz
        later[entry.tool] = (tip, entry)


def nozzle_of(entry: Recorded) -> str:
    """Return the nozzle id of an entry, empty if nobody gave one."""
    return nozzle_in(entry.details, entry.signature.nozzle)


def nozzle_in(details: Mapping[str, object], of_the_run: str) -> str:
    """Return the nozzle id of a record; its own precedes that of the run."""
    own = details.get("nozzle")
    return own if isinstance(own, str) and own else of_the_run
