"""How the end of a nozzle looks from below: what of it is round, rough, dirty or off its middle.

Everything here is fixed to the tool and turns with it. All of it is assumed; the ranges are those
of drawings on which finders were compared (docs/reference/simulated-cell.md 4).
"""

import math
import random
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Literal

TipKind = Literal["clean", "rough", "stepped", "needle"]
"""What is at the end: a turned nozzle, a worn one, one with a chamfer, or a bevelled needle."""

_ROUGH_SHARE: Final = (0.015, 0.04)
_SMOOTH_SHARE: Final = 0.002


@dataclass(frozen=True, slots=True)
class TipBuild:
    """What is said of a tip; the rest is drawn from a seed.

    Attributes:
        kind: What is at the end.
        diameter_mm: Of its face; of a needle, of its tube.
        bore_mm: Diameter of its bore; 0 for a solid tip.
        bore_aside_mm: How far the bore is off the middle of the face.
        dirt: How many specks stick to it.
        dark: Whether it is black, hardly brighter than what is around it.
    """

    kind: TipKind = "clean"
    diameter_mm: float = 1.0
    bore_mm: float = 0.5
    bore_aside_mm: float = 0.0
    dirt: int = 0
    dark: bool = False


@dataclass(frozen=True, slots=True)
class Speck:
    """Dirt on a face.

    Attributes:
        at: Where, in radii of the face, along X and Y of the tool.
        size: Its radius, in radii of the face.
        grey: How bright it is, 0 to 255.
    """

    at: tuple[float, float]
    size: float
    grey: float


@dataclass(frozen=True, slots=True)
class ToldLook:
    """What is told of the look of a tip.

    Attributes:
        kind: What is at its end.
        diameter_mm: Of its face.
        bore_mm: Diameter of its bore; 0 for none.
        seen_beside_mm: How far beside the tip the circle lies that fits its edge best, in X and Y
            of the tool: it turns with the tool, so no finder sees it and no residual shows it.
    """

    kind: TipKind
    diameter_mm: float
    bore_mm: float
    seen_beside_mm: tuple[float, float]


@dataclass(frozen=True, slots=True)
class TipLook:
    """One end of a tool. Lengths in mm, in the tool's X and Y.

    Attributes:
        kind: What is at the end.
        radius_mm: Of the face.
        edge: By what share the edge is beside that radius, at equal angles about the tool's Z;
            straight lines in between.
        face, bore, cone: How bright the face, the bore and what is above it are, 0 to 255.
        bore_mm: Radius of the bore; 0 for none.
        bore_at_mm: Where its middle is.
        shank_mm: Radius of the shank above the cone.
        cone_mm: Height of the cone.
        step: Radius of the flat inside a chamfer, as a share; 1 for no chamfer.
        step_at_mm: Where its middle is.
        step_shade: How bright the chamfer is, as a share of the face.
        bevel_deg: Direction toward which the needle's point lies.
        texture: How much the brightness of the face varies over it, as a share.
        texture_seed: Of that pattern.
        dirt: What sticks to it.
    """

    kind: TipKind
    radius_mm: float
    edge: tuple[float, ...]
    face: float
    bore: float
    cone: float
    bore_mm: float
    bore_at_mm: tuple[float, float]
    shank_mm: float
    cone_mm: float
    step: float
    step_at_mm: tuple[float, float]
    step_shade: float
    bevel_deg: float
    texture: float
    texture_seed: int
    dirt: tuple[Speck, ...]

    def blackened(self) -> "TipLook":
        """Return it black: as render drawings of black nozzles, a third as bright and 8 more."""
        return replace(self, face=0.35 * self.face + 8, cone=0.35 * self.cone + 8)

    def told(self) -> ToldLook:
        """Return what is told of it."""
        return ToldLook(self.kind, 2 * self.radius_mm, 2 * self.bore_mm, self.seen_beside_mm)

    @property
    def seen_beside_mm(self) -> tuple[float, float]:
        """How far beside the tip the circle lies that fits its edge best; in X and Y of the tool.

        That of least squares over all directions, to first order: the first harmonic of the edge,
        whose straight lines between equal angles damp it by a sinc squared.
        """
        count = len(self.edge)
        damped = (math.sin(math.pi / count) / (math.pi / count)) ** 2
        each_mm = 2 * self.radius_mm * damped / count
        angles = [math.tau * number / count for number in range(count)]
        return (
            sum(
                each_mm * at * math.cos(angle) for at, angle in zip(self.edge, angles, strict=True)
            ),
            sum(
                each_mm * at * math.sin(angle) for at, angle in zip(self.edge, angles, strict=True)
            ),
        )


@lru_cache(maxsize=32)
def look_drawn(build: TipBuild, seed: str) -> TipLook:
    """Return the tip that a seed draws."""
    rng = random.Random(f"look of {seed}")
    radius_mm, rough = build.diameter_mm / 2, build.kind == "rough"
    share = rng.uniform(*_ROUGH_SHARE) if rough else _SMOOTH_SHARE
    edge = tuple(rng.gauss(0.0, share) for _ in range(rng.randint(24, 64)))
    bore_mm, aside = build.bore_mm / 2, rng.uniform(0.0, math.tau)
    off_mm, way = 0.03 * radius_mm * rng.random(), rng.uniform(0.0, math.tau)
    face = rng.uniform(150.0, 220.0)
    look = TipLook(
        kind=build.kind,
        radius_mm=radius_mm,
        edge=edge,
        face=face,
        bore=rng.uniform(5.0, 30.0),
        cone=rng.uniform(40.0, 90.0),
        bore_mm=bore_mm,
        bore_at_mm=_polar(build.bore_aside_mm, aside),
        shank_mm=radius_mm * (1.0 if build.kind == "needle" else rng.uniform(2.2, 3.5)),
        cone_mm=6 * radius_mm * rng.uniform(0.8, 1.2),
        step=rng.uniform(0.72, 0.9) if build.kind == "stepped" else 1.0,
        step_at_mm=_polar(off_mm, way),
        step_shade=rng.uniform(0.45, 0.8),
        bevel_deg=rng.uniform(0.0, 360.0),
        texture=rng.uniform(0.08, 0.2) if rough else 0.02,
        texture_seed=rng.getrandbits(32),
        dirt=tuple(_speck(rng, bore_mm / radius_mm) for _ in range(build.dirt)),
    )
    return look if not build.dark else look.blackened()


def _polar(length: float, angle: float) -> tuple[float, float]:
    return length * math.cos(angle), length * math.sin(angle)


def _speck(rng: random.Random, bore: float) -> Speck:
    """Return one on the edge of the face or of the bore."""
    out = rng.choice((bore, 1.0))
    return Speck(
        _polar(out, rng.uniform(0.0, math.tau)), rng.uniform(0.1, 0.3), rng.uniform(10, 230)
    )
