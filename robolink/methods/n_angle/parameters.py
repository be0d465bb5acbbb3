"""The parameters of n-angle."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated, Final

from annotated_types import Ge, Le, MaxLen, MinLen

from robolink.calibration import MIN_ROTATION_DEG, planar_sigma_gain
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.declaration.method import DEGREES, Angle, Check, Help, Length, Option
from robolink.methods.declaration.pin_parameters import Retake, UprightPinParameters
from robolink.model import Pose, angle_difference_deg
from robolink.procedures import SamplingPolicy

_SAME_ANGLE_DEG: Final = 1e-9


@dataclass(frozen=True, kw_only=True)
class NAngleParameters(UprightPinParameters):
    """How one pin is touched at several angles of U."""

    count: Annotated[
        int,
        Ge(3),
        Le(24),
        Help(declared("Number of touches, spread evenly over a full turn.")),
    ] = 6
    angles_deg: Annotated[
        tuple[Angle, ...] | None,
        MinLen(3),
        MaxLen(24),
        DEGREES,
        Option(flag="--angles", metavar="0,120,.."),
        Help(
            declared("Instead of a count: U of each touch, relative to the first one, which is 0.")
        ),
    ] = None
    until_mm: Annotated[
        Length | None,
        Option(metavar="MM"),
        Help(declared("End early when X and Y are repeatable to this in 95 %.")),
    ] = None
    retake: Retake = False

    @property
    def touches_deg(self) -> tuple[float, ...]:
        """U of each touch, counted from the first one."""
        if self.angles_deg is not None:
            return self.angles_deg
        return tuple(360.0 * number / self.count for number in range(self.count))

    @property
    def turns_deg(self) -> tuple[float, ...]:
        """U of the touches after the first, counted from it, in the order in which they are taken.

        Angles that the person wrote are taken in the person's order. Others never ascend: what
        drifts from touch to touch would else look like a part of the tip
        (docs/reference/evidence.md 8).
        """
        turns = self.touches_deg[1:]
        return turns if self.angles_deg is not None else most_informative_order(turns)

    @property
    def sampling(self) -> SamplingPolicy:
        """When it ends, and whether a pose is offered to be taken again."""
        return SamplingPolicy(self.until_mm, retake=self.retake)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the angles tell the tip."""
        if self.angles_deg is not None:
            if "count" in check.given:
                others = check.spell("angles_deg")
                yield Problem("count", tr("excludes {other}; give one of them", other=others))
            yield from _of_angles(self.angles_deg)
        yield from super().problems(check)

    def sigma_gain(self) -> float | None:
        """Return the tip's standard deviation as a multiple of a touch's."""
        return gain_of_turns(self.touches_deg)


def most_informative_order(turns_deg: Sequence[float]) -> tuple[float, ...]:
    """Return the same angles, those first that tell the most together with the ones before.

    The first touch is at 0. Whoever ends early then ends with angles that are spread well.
    """
    chosen, left = [0.0], list(turns_deg)
    while left:
        best = min(
            left, key=lambda turn: (round(gain_of_turns([*chosen, turn]), 9), left.index(turn))
        )
        left.remove(best)
        chosen.append(best)
    return tuple(chosen[1:])


def gain_of_turns(turns_deg: Sequence[float]) -> float:
    """Return the tip's standard deviation as a multiple of a touch's, for touches at angles."""
    return planar_sigma_gain([Pose(0.0, 0.0, 0.0, turn) for turn in turns_deg])


def _of_angles(angles_deg: tuple[float, ...]) -> Iterator[Problem]:
    if angles_deg[0] != 0:
        yield Problem("angles_deg#1", tr("must be 0: the angles count from the first touch"))
    apart_deg = [abs(angle_difference_deg(a, b)) for a, b in combinations(angles_deg, 2)]
    if min(apart_deg) <= _SAME_ANGLE_DEG:
        yield Problem(
            "angles_deg", tr("must not hold the same angle twice; 0 and 360 are the same")
        )
    elif max(apart_deg) < MIN_ROTATION_DEG:
        yield Problem(
            "angles_deg", tr("must spread over at least {limit:g} degrees", limit=MIN_ROTATION_DEG)
        )
