"""Limits and speeds of a run."""

from dataclasses import dataclass

from robolink.model import WorkBox


@dataclass(frozen=True, slots=True)
class RunSettings:
    """Limits of a run.

    Attributes:
        box: Where targets may lie, in coordinates of the frame that moves.
        speed_percent: For joint moves, in low power.
        speed_mm_s: For straight moves, in low power.
        max_jog_mm: Largest single step that a person may type.
        max_jog_deg: The same for U.
        motion_timeout_s: Longest duration of one movement before it is aborted.
    """

    box: WorkBox
    speed_percent: int = 5
    speed_mm_s: float = 20.0
    max_jog_mm: float = 5.0
    max_jog_deg: float = 5.0
    motion_timeout_s: float = 120.0
