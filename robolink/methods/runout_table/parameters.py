"""The parameters of runout-table."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from annotated_types import MaxLen, MinLen

from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.declaration.look_parameters import LookParameters
from robolink.methods.declaration.method import DEGREES, Angle, Check, Help, Option
from robolink.procedures import LookPlan

LARGEST_GAP_DEG = 60.0
"""The solver says it too."""

_LEAST_LOOKS = 8


@dataclass(frozen=True, slots=True)
class AllRoundPlan(LookPlan):
    """Looks all round, within half a turn to either side of U = 0, as wrists can go.

    They begin at the end that is nearer and go on from neighbour to neighbour, so that every turn
    but the first is small and the first less than half a turn.
    """

    def angles_deg(self, u_deg: float) -> tuple[float, ...]:
        """Return U of every look for a tool that stands at ``u_deg``, in order."""
        # Between -180, which it leaves out, and 180.
        within = [180.0 - (180.0 - u_deg - turn_deg) % 360.0 for turn_deg in self.turns_deg]
        return tuple(sorted(within, reverse=u_deg > 0))


@dataclass(frozen=True, kw_only=True)
class RunoutTableParameters(LookParameters):
    """How a calibrated camera looks at a tip all round."""

    turns_deg: Annotated[
        tuple[Angle, ...],
        MinLen(_LEAST_LOOKS),
        MaxLen(72),
        DEGREES,
        Option(flag="--angles", metavar="0,30,.."),
        Help(
            declared(
                "U of each look, counted from where the tool stands: all round, in steps of 60 or "
                "less. Each becomes a row of the table."
            )
        ),
    ] = tuple(30.0 * step for step in range(12))

    @property
    def look(self) -> LookPlan:
        """The same for a procedure."""
        return AllRoundPlan(
            turns_deg=self.turns_deg,
            pictures=self.pictures,
            lift_mm=self.lift_mm,
            beside_mm=self.beside_mm,
        )

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the looks go all round."""
        yield from super().problems(check)
        turned = sorted(turn % 360.0 for turn in self.turns_deg)
        gaps = (b - a for a, b in zip(turned, [*turned[1:], turned[0] + 360.0], strict=True))
        if max(gaps) > LARGEST_GAP_DEG:
            yield Problem(
                "turns_deg",
                tr(
                    "must go all round in steps of {limit:g} degrees or less", limit=LARGEST_GAP_DEG
                ),
            )
