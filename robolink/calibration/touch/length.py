"""Whether a tip has a different length, from the heights of its touches on one pin.

Methods that touch a pin upright measure X and Y; Z is kept. But the same pin, touched in the same
orientation, puts the flange the higher, the longer the tip is:

    dz = mean(z now) - mean(z then),    u(dz) = sigma_z sqrt(1 / N_now + 1 / N_then)
    t_z = stored t_z - cos V cos W dz,

which is -dz for W = 0 and +dz for W = 180 (t = t_old - R' dp). Beyond max(0.10 mm, 3.29 u) the
length changed: false alarms 0.1 % at most (docs/reference/evidence.md 2). One tool cannot tell a
shorter pin from a longer tip, so the pin has to be the same, and where it was.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Final, Literal

from robolink.calibration.core.dispersion import require_positive
from robolink.calibration.core.pose_checks import require_finite
from robolink.calibration.core.statistics import NORMAL_95
from robolink.calibration.quality.doubts import PERSON_SIGMA_Z_MM
from robolink.calibration.touch.touch_evidence import height_limit_mm
from robolink.errors import CalibrationError
from robolink.messages import tr

LengthDecision = Literal["difference", "keep", "measure"]
"""Decision about a changed length: write Z by difference, keep it, or measure it."""

LEAST_LENGTH_CHANGE_MM: Final = 0.10
"""Smallest change of length, in mm; touches by a person differ by less than this anyway."""

_NO_CHANGE_QUANTILE: Final = 3.29

_LEAST_HALF_MM: Final = 0.005


@dataclass(frozen=True, slots=True)
class LengthChange:
    """The length of a tip compared with the stored one.

    Attributes:
        height_change_mm: By how much higher the flange was, mm.
        u_mm: Its standard uncertainty.
        limit_mm: Beyond it the length changed.
        stored_z_mm: Z of the stored offset.
        z_by_difference_mm: Z that the heights tell.
    """

    height_change_mm: float
    u_mm: float
    limit_mm: float
    stored_z_mm: float
    z_by_difference_mm: float

    @property
    def changed(self) -> bool:
        """Whether the length differs: ``length_changed``."""
        return abs(self.height_change_mm) > self.limit_mm

    @property
    def half95_mm(self) -> float:
        """Half the 95 % interval of the change; at least half of the last digit shown."""
        return max(NORMAL_95 * self.u_mm, _LEAST_HALF_MM)

    @property
    def longer_mm(self) -> float:
        """By how much the tip is longer; negative for a shorter one."""
        return abs(self.z_by_difference_mm) - abs(self.stored_z_mm)

    def z_mm(self, decision: LengthDecision | None) -> float | None:
        """Return the Z that a decision writes; ``None`` if it has to be measured or decided.

        A length that did not change is kept, whatever was decided in advance.
        """
        if not self.changed or decision == "keep":
            return self.stored_z_mm
        return self.z_by_difference_mm if decision == "difference" else None


def length_change(
    before_z_mm: Sequence[float],
    after_z_mm: Sequence[float],
    *,
    stored_z_mm: float,
    v_deg: float = 0.0,
    w_deg: float = 0.0,
    sigma_z_mm: float = PERSON_SIGMA_Z_MM,
    u_place_mm: float = 0.0,
    pin_moved: bool = False,
) -> LengthChange:
    """Compare the heights of two runs on one pin.

    Args:
        before_z_mm: Z of the flange at each touch when the stored Z was right, base, mm.
        after_z_mm: Z of the flange at each touch now.
        stored_z_mm: Z of the stored offset.
        v_deg: V of the flange at all touches, the same in both runs.
        w_deg: W of the flange, likewise.
        sigma_z_mm: Standard deviation of the height of one touch.
        u_place_mm: Standard uncertainty of the height of then beside that of its touches: that of a
            pin whose height another tool found.
        pin_moved: Whether the pin is another, or moved since.

    Raises:
        CalibrationError: ``length_not_observable``: the pin moved; ``too_few_poses``: a run has no
            touch; ``touch_heights_differ``: a run contradicts itself; ``non_finite``.
        ConfigError: ``sigma_z_mm`` is not positive.

    Example:
        >>> from robolink.calibration import length_change
        >>> found = length_change([-60.00, -60.01], [-59.61, -59.60], stored_z_mm=-20)
        >>> found.changed, round(found.longer_mm, 3)
        (True, 0.4)
    """
    require_positive(sigma_z_mm, "sigma_z_mm")
    require_finite(stored_z_mm=stored_z_mm, v_deg=v_deg, w_deg=w_deg)
    for name, heights in (("before", before_z_mm), ("after", after_z_mm)):
        _require_agreeing(name, heights, sigma_z_mm)
    if pin_moved:
        raise length_not_observable(tr("The pin is not where it was."))
    change = fmean(after_z_mm) - fmean(before_z_mm)
    touches = sigma_z_mm * math.sqrt(1 / len(before_z_mm) + 1 / len(after_z_mm))
    u_mm = math.hypot(touches, u_place_mm)
    along = math.cos(math.radians(v_deg)) * math.cos(math.radians(w_deg))
    return LengthChange(
        height_change_mm=change,
        u_mm=u_mm,
        limit_mm=max(LEAST_LENGTH_CHANGE_MM, _NO_CHANGE_QUANTILE * u_mm),
        stored_z_mm=stored_z_mm,
        z_by_difference_mm=stored_z_mm - along * change,
    )


def length_not_observable(why: str) -> CalibrationError:
    """Return the error for a length that heights cannot show; ``reason`` is a whole sentence."""
    return CalibrationError(
        "length_not_observable",
        tr("{why} The heights of the touches do not show the length of the tip.", why=why),
        remedy=tr("Measure Z by touching a surface, or keep it."),
    )


def _require_agreeing(name: str, heights_mm: Sequence[float], sigma_z_mm: float) -> None:
    if not heights_mm:
        raise CalibrationError(
            "too_few_poses",
            tr("The run {name} has no touch.", name=name),
            remedy=tr("Touch the pin with both tips."),
        )
    for number, height in enumerate(heights_mm, start=1):
        require_finite(**{f"height {number} {name}": height})
    spread = max(heights_mm) - min(heights_mm)
    if len(heights_mm) > 1 and spread > height_limit_mm(len(heights_mm), sigma_z_mm):
        raise CalibrationError(
            "touch_heights_differ",
            tr(
                "Heights differ by {spread:.2f} mm on one pin: at least one touch was in the air.",
                spread=spread,
            ),
            remedy=tr("Touch the pin again. Each time, jog until the tip is on it."),
        )
