"""The SCARA models that can be simulated, with the evidence for each row."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from robolink.errors import ConfigError
from robolink.messages import tr


class Evidence(StrEnum):
    """How far a row can be trusted."""

    DOCUMENTED = "documented"
    PARTLY_ASSUMED = "partly assumed"


class Range(NamedTuple):
    """Travel of one joint, ends included: degrees, mm for joint 3."""

    low: float
    high: float

    def holds(self, value: float) -> bool:
        """Tell whether ``value`` lies inside; 1e-9 absorbs the arithmetic of a round trip."""
        return self.low - 1e-9 <= value <= self.high + 1e-9


@dataclass(frozen=True, slots=True)
class ScaraModel:
    """Geometry and drives of one robot (docs/reference/epson.md 4).

    Joints 1, 2 and 4 count degrees, joint 3 mm downwards from 0.

    Attributes:
        name: As on the type plate.
        a1_mm: Length of the first link.
        a2_mm: Length of the second link.
        ranges: Travel of joints 1 to 4.
        pulses_per_unit: Encoder pulses per degree, per mm for joint 3.
        top_speed: Joint speeds at Speed 100, in degrees/s, mm/s for joint 3.
        source: Where the row comes from.
        assumed: What in the row no document gives.
    """

    name: str
    a1_mm: float
    a2_mm: float
    ranges: tuple[Range, Range, Range, Range]
    pulses_per_unit: tuple[float, float, float, float]
    top_speed: tuple[float, float, float, float]
    source: str
    assumed: str

    @property
    def evidence(self) -> Evidence:
        """The mark of the whole row."""
        return Evidence.PARTLY_ASSUMED if self.assumed else Evidence.DOCUMENTED


_TURN = 360.0

# docs/reference/epson.md 4: measured on a G3, the only SCARA whose joint 3 and 4 scales are known.
_J3_PULSES_PER_MM = 1706667 / 150.0
_J4_PULSES_PER_DEG = 1494221 / _TURN

# No readable document gives joint speeds: order of magnitude of a small SCARA.
_TOP_SPEED = (360.0, 540.0, 1000.0, 1500.0)


def _t_series(
    name: str, links_mm: tuple[float, float], j1_pulses: int, j2_deg: float, stroke_mm: float
) -> ScaraModel:
    return ScaraModel(
        name,
        *links_mm,
        ranges=(Range(-42, 222), Range(-j2_deg, j2_deg), Range(-stroke_mm, 0), Range(-360, 360)),
        pulses_per_unit=(
            j1_pulses / _TURN,
            819200 / _TURN,
            _J3_PULSES_PER_MM,
            _J4_PULSES_PER_DEG,
        ),
        top_speed=_TOP_SPEED,
        source="docs/reference/epson.md 4 (TB): reach, joint ranges, pulses of joints 1 and 2",
        assumed="link split, stroke of T6, pulses of joints 3 and 4 (G3's), joint speeds",
    )


def _gx_series(
    name: str,
    links_mm: tuple[float, float],
    *,
    j1_deg: tuple[float, float],
    j2_deg: float,
    stroke_mm: float,
) -> ScaraModel:
    return ScaraModel(
        name,
        *links_mm,
        ranges=(Range(*j1_deg), Range(-j2_deg, j2_deg), Range(-stroke_mm, 0), Range(-360, 360)),
        pulses_per_unit=(
            10485760 / _TURN,
            10485760 / _TURN,
            _J3_PULSES_PER_MM,
            _J4_PULSES_PER_DEG,
        ),
        top_speed=_TOP_SPEED,
        source="docs/reference/epson.md 4 (ROS2, GX): links, joint ranges; pulses of GX4 joint 1",
        assumed="pulses of joint 1 of GX8, of joint 2, of joints 3 and 4 (G3's), joint speeds",
    )


ROBOTS: Final[tuple[ScaraModel, ...]] = (
    _t_series("T3-401S", (225, 175), 819200, 141, 150),
    _t_series("T6-602S", (325, 275), 1310720, 150, 200),
    _gx_series("GX4-C251S", (124, 126), j1_deg=(-50, 230), j2_deg=141, stroke_mm=150),
    _gx_series("GX4-C301S", (170, 130), j1_deg=(-50, 230), j2_deg=142, stroke_mm=150),
    _gx_series("GX4-C351S", (220, 130), j1_deg=(-50, 230), j2_deg=142, stroke_mm=150),
    _gx_series("GX8-C452S", (200, 250), j1_deg=(-62, 242), j2_deg=147.25, stroke_mm=200),
    _gx_series("GX8-C552S", (300, 250), j1_deg=(-62, 242), j2_deg=147.25, stroke_mm=200),
    _gx_series("GX8-C652S", (400, 250), j1_deg=(-62, 242), j2_deg=147.25, stroke_mm=200),
)


def find_robot(name: str) -> ScaraModel:
    """Return the model called ``name``, in any case.

    Raises:
        ConfigError: There is no such row.
    """
    for model in ROBOTS:
        if model.name.casefold() == name.casefold():
            return model
    raise ConfigError(
        tr("There is no simulated robot {name!r}.", name=name),
        remedy=tr("Choose one of {names}.", names=", ".join(model.name for model in ROBOTS)),
    )
