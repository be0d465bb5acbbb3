"""What a finder answers: everything that may be what was looked for, and why it was refused."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from robolink.eye.picture import CameraPicture

__all__ = [
    "Candidate",
    "CandidateRefusal",
    "MarkFinder",
    "MarkShape",
    "Polarity",
    "RefusalCode",
    "TipShape",
    "ranked",
]


class Polarity(StrEnum):
    """How the face of a tip differs from what is around it."""

    BRIGHT = "bright"
    DARK = "dark"
    EITHER = "either"


class RefusalCode(StrEnum):
    """Why something in a picture is not taken for a tip, or for a fiducial."""

    FEW_RAYS = "few_rays"
    NO_BORE = "no_bore"
    BORE_ASIDE = "bore_aside"
    OTHER_BORE = "other_bore"
    FAINT_EDGE = "faint_edge"
    CUT = "cut"
    OTHER_RADIUS = "other_radius"
    NOT_ROUND = "not_round"
    POOR_FIT = "poor_fit"
    BLURRED = "blurred"
    INSIDE_ANOTHER = "inside_another"
    WORSE_THAN_ANOTHER = "worse_than_another"
    NOT_FILLED = "not_filled"
    OTHER_MARK = "other_mark"


@dataclass(frozen=True, slots=True)
class CandidateRefusal:
    """One reason, with what was measured and what it is compared with.

    Attributes:
        code: Which.
        measured, limit: The two numbers, in the unit of that code.
    """

    code: RefusalCode
    measured: float
    limit: float


@dataclass(frozen=True, slots=True)
class TipShape:
    """What is known of a tip before it is looked for.

    Attributes:
        radius_px: Half the diameter of its face in pixels; ``None`` where nobody knows yet, which
            is for teaching only, with a person looking.
        within: Share by which the radius may differ.
        bore: Whether it has a hole in its middle, as nozzles and needles have.
        polarity: How its face differs from what is around it.
        bore_ratio: Radius of the bore as a share of the face's, as taught; ``None`` for any.
        edge_px: Width of its edge in focus, as taught; ``None`` for any.
    """

    radius_px: float | None
    within: float = 0.20
    bore: bool = True
    polarity: Polarity = Polarity.EITHER
    bore_ratio: float | None = None
    edge_px: float | None = None


@dataclass(frozen=True, slots=True)
class MarkShape:
    """What is known of the fiducials of a board before they are looked for.

    Attributes:
        radius_px: Half the width of one in pixels: of a pad, a cross from end to end, a side of an
            ArUco marker.
        within: Share by which that may differ.
        polarity: How one differs from what is around it; an ArUco marker is dark by its border.
        edge_px: Width of its edge in focus, as taught; ``None`` for any.
    """

    radius_px: float
    within: float = 0.20
    polarity: Polarity = Polarity.EITHER
    edge_px: float | None = None


@dataclass(frozen=True, slots=True)
class Candidate:
    """Something in a picture that may be a tip.

    Attributes:
        x_px, y_px: Its middle: X to the right and Y down, (0, 0) the middle of the first pixel.
        radius_px: Half its width.
        score: How well it fits, 0 to 1.
        rays: Share of the rays that met its edge.
        edge_px: Width of its edge, 10 to 90 %: how far out of focus it is.
        bore_ratio: Radius of its bore as a share of its own; ``None`` where none was found.
        refused: Why it is not taken; empty for one that is.
    """

    x_px: float
    y_px: float
    radius_px: float
    score: float
    rays: float = 0.0
    edge_px: float | None = None
    bore_ratio: float | None = None
    refused: tuple[CandidateRefusal, ...] = ()

    @property
    def accepted(self) -> bool:
        """Whether nothing speaks against it."""
        return not self.refused


class MarkFinder(Protocol):
    """Looks for something in a picture."""

    def __call__(self, picture: CameraPicture) -> Sequence[Candidate]:
        """Return all candidates, the accepted ones first, the best of them first."""


def ranked(found: Sequence[Candidate], *, apart_px: float) -> tuple[Candidate, ...]:
    """Return candidates, the accepted ones first, and of each place the best only.

    Args:
        found: Them.
        apart_px: How far two places are apart at least.
    """
    kept = list[Candidate]()
    for one in sorted(found, key=lambda it: (not it.accepted, len(it.refused), -it.score)):
        if all(math.hypot(one.x_px - k.x_px, one.y_px - k.y_px) >= apart_px for k in kept):
            kept.append(one)
    return tuple(kept)
