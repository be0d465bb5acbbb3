"""The proof of a tip on a surface that is known: where it would have to be, told by all touches.

One touch shows how far the tip is off along the surface's normal alone. Touches in several tilts
show all three components: ``n_i R_i e = -d_i``, with d_i how far beyond the expected place the
frame went until the tip was on the surface (docs/reference/calibration.md 2.13).
"""

import math
from dataclasses import dataclass, field

import numpy as np

from robolink.calibration import Drift, DriftVerdict, VerifyResult, judge_drift, rotation_of
from robolink.model import Pose
from robolink.runner import TouchedAt

Direction = tuple[float, float, float]


@dataclass(slots=True)
class SurfaceProof:
    """What touches of a known surface say about where the tip is.

    Attributes:
        shown_at: The pose in which the drift is shown.
        tolerance_mm: Largest drift that passes with its guard band, all directions together.
        u_mm: Standard uncertainty of what one touch shows.
        touches: Those made, in their order.
    """

    shown_at: Pose
    tolerance_mm: float
    u_mm: float
    touches: list[TouchedAt] = field(default_factory=list)
    _rows: list[list[float]] = field(default_factory=list)
    _beyond_mm: list[float] = field(default_factory=list)

    def add(self, place: Pose, found: TouchedAt, normal: Direction) -> None:
        """Take a touch.

        Args:
            place: Where the frame in force should have been.
            found: Where it was.
            normal: The surface's unit normal there.

        Example:
            >>> import math
            >>> from robolink.model import Pose
            >>> from robolink.procedures import SurfaceProof
            >>> from robolink.runner import TouchedAt
            >>> tilts = (0, 0), (40, 0), (-40, 0), (0, 40), (0, -40)
            >>> places = [Pose(0, 0, 0, 0, v_deg, w_deg) for v_deg, w_deg in tilts]
            >>> proof = SurfaceProof(places[0], tolerance_mm=0.2, u_mm=0.02)
            >>> for place in places:  # the tip is 0.1 mm short
            ...     deeper_mm = 0.1 * math.cos(math.radians(place.v_deg or place.w_deg))
            ...     found = Pose(0, 0, -deeper_mm, *place.coordinates()[3:])
            ...     proof.add(place, TouchedAt.of(found), normal=(0, 0, 1))
            >>> round(proof.drift().dz_mm, 3)
            0.1
        """
        self.touches.append(found)
        self._rows.append((np.array(normal) @ rotation_of(place)).tolist())
        way = zip(found.coordinates()[:3], place.coordinates()[:3], normal, strict=True)
        self._beyond_mm.append(sum((there - here) * along for there, here, along in way))

    def undecided(self) -> bool:
        """Whether the drift is neither surely inside the tolerance nor surely outside."""
        drift = self.drift()
        verdict = judge_drift(drift.distance_mm, drift.u_mm, self.tolerance_mm)
        return verdict is DriftVerdict.UNDECIDED

    def drift(self) -> Drift:
        """Return where the tip is beside where it should be, base axes at ``shown_at``."""
        rows = np.array(self._rows)
        turned = rotation_of(self.shown_at)
        _, sizes, _ = np.linalg.svd(rows, full_matrices=False)
        e, *_ = np.linalg.lstsq(rows, -np.array(self._beyond_mm), rcond=None)
        dx_mm, dy_mm, dz_mm = (turned @ e).tolist()
        weakest = float(sizes[-1]) if len(sizes) == len(turned) else 0.0
        u_mm = self.u_mm / weakest if weakest > 0 else math.inf
        return Drift(self.shown_at.u_deg, dx_mm, dy_mm, dz_mm, u_mm)

    def result(self) -> VerifyResult:
        """Return what they say together."""
        return VerifyResult(
            (self.drift(),), self.tolerance_mm, inputs=tuple(self.touches), in_space=True
        )
