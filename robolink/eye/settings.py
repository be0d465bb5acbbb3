"""What an eye has to know of the tip, of the fiducials and of its camera."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Self

from robolink.errors import ConfigError
from robolink.eye.candidate import MarkShape, Polarity, TipShape
from robolink.messages import tr

__all__ = ["EyeSettings", "MARKS"]

MARKS: Final = ("round", "cross", "aruco", "aruco-5x5", "aruco-6x6", "aruco-7x7")
"""The kinds of fiducials that can be found; ``aruco`` has 4 by 4 bits."""

STATED_WITHIN: Final = 0.20
"""Share by which a radius may differ from the stated one: people state what a drawing says."""

TAUGHT_WITHIN: Final = 0.06
"""The same for a taught one: with it, a chamfer is not taken for the outline
(docs/reference/eye.md "How often it is right").
"""


@dataclass(frozen=True, slots=True)
class EyeSettings:
    """What is stated in the cell file, and what was taught at the station.

    Attributes:
        diameter_mm: Diameter of the face of the tip, as stated.
        radius_px: Half of that in pixels: as taught, else from ``diameter_mm`` and ``mm_per_px``;
            ``None`` where nobody knows, which is for teaching only.
        bore: Whether the tip has a hole in its middle.
        polarity: How its face differs from what is around it.
        bore_ratio: Radius of the hole as a share of the face's, as taught.
        edge_px: Width of its edge in focus, as taught.
        exposure_us: Exposure time, as stated or taught; ``None`` leaves the camera as it is.
        lag_s: How old a picture of this source may be, as taught: waited before every look.
        lag_pictures: How many pictures it keeps back, as taught: taken and not used.
        marks: Kind of the fiducials of a board, one of :data:`MARKS`.
        mark_mm: Diameter of a round fiducial, else its width.
        mm_per_px: Length of a pixel, ``None`` where that is not known.
        taught: Whether ``radius_px`` was taught, and not calculated from the diameter.
    """

    diameter_mm: float | None = None
    radius_px: float | None = None
    bore: bool = True
    polarity: Polarity = Polarity.EITHER
    bore_ratio: float | None = None
    edge_px: float | None = None
    exposure_us: float | None = None
    lag_s: float = 0.0
    lag_pictures: int = 0
    marks: str = "round"
    mark_mm: float | None = None
    mm_per_px: float | None = None
    taught: bool = False

    @classmethod
    def of(cls, details: Mapping[str, object], *, mm_per_px: float | None = None) -> Self:
        """Return the settings of a station.

        Args:
            details: What is stated and taught of it; other keys are left alone.
            mm_per_px: Length of a pixel, where the camera is calibrated.

        Raises:
            ConfigError: A value is not of its kind.

        Example:
            >>> from robolink.eye.settings import EyeSettings
            >>> EyeSettings.of({"diameter_mm": 0.8}, mm_per_px=0.02).radius_px
            20.0
        """
        diameter_mm = _length(details, "diameter_mm")
        radius_px = _length(details, "radius_px")
        if radius_px is None and diameter_mm is not None and mm_per_px:
            radius_px = diameter_mm / 2 / mm_per_px
        return cls(
            diameter_mm=diameter_mm,
            radius_px=radius_px,
            bore=bool(_choice(details, "bore", True, (True, False))),
            polarity=Polarity(str(_choice(details, "polarity", "either", tuple(Polarity)))),
            bore_ratio=_length(details, "bore_ratio"),
            edge_px=_length(details, "edge_px"),
            exposure_us=_length(details, "exposure_us"),
            lag_s=_number(details, "lag_s"),
            lag_pictures=int(_number(details, "lag_pictures")),
            marks=str(_choice(details, "marks", "round", MARKS)),
            mark_mm=_length(details, "mark_mm"),
            mm_per_px=mm_per_px,
            taught=details.get("radius_px") is not None,
        )

    @property
    def tip(self) -> TipShape:
        """What a finder has to know of the tip."""
        return TipShape(
            radius_px=self.radius_px,
            within=TAUGHT_WITHIN if self.taught else STATED_WITHIN,
            bore=self.bore,
            polarity=self.polarity,
            bore_ratio=self.bore_ratio,
            edge_px=self.edge_px,
        )

    @property
    def fiducial(self) -> MarkShape | None:
        """What a finder has to know of the fiducials; ``None`` where their width is not known.

        The width of an edge in focus is that of the tip: the lens makes it.
        """
        if self.mark_mm is None or not self.mm_per_px:
            return None
        return MarkShape(self.mark_mm / 2 / self.mm_per_px, edge_px=self.edge_px)


def _length(details: Mapping[str, object], key: str) -> float | None:
    """Return a number above zero, ``None`` where there is none."""
    if details.get(key) is None:
        return None
    number = _number(details, key)
    if number <= 0:
        raise _wrong(details, key, tr("a number above zero"))
    return number


def _number(details: Mapping[str, object], key: str) -> float:
    """Return a number that is not negative; 0 where there is none."""
    value = details.get(key, 0.0)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise _wrong(details, key, tr("a number"))
    if not math.isfinite(value) or value < 0:
        raise _wrong(details, key, tr("a number that is not negative"))
    return float(value)


def _choice(
    details: Mapping[str, object], key: str, default: object, known: tuple[object, ...]
) -> object:
    value = details.get(key, default)
    if isinstance(value, type(default)) and value in known:
        return value
    raise _wrong(details, key, ", ".join(str(one).lower() for one in known))


def _wrong(details: Mapping[str, object], key: str, wanted: str) -> ConfigError:
    return ConfigError(
        tr("The camera's {key} is {value!r}.", key=key, value=details.get(key)),
        remedy=tr("Correct it in the cell file: {wanted}.", wanted=wanted),
    )
