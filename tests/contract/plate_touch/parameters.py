"""The parameters of plate-touch."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Le

from robolink.files.toml import Problem
from robolink.messages import tr
from robolink.methods import MM, MM_S, Check, Help, MethodParameters


@dataclass(frozen=True, kw_only=True)
class PlateTouchParameters(MethodParameters):
    """How the tip is lowered onto a plate."""

    slow_mm_s: Annotated[
        float, Ge(0.1), Le(5), MM_S, Help(tr("Speed of one touch; the other is twice as fast."))
    ] = 1.0
    clearance_mm: Annotated[
        float, Ge(0.5), Le(20), MM, Help(tr("How far above the plate the tip begins to seek it."))
    ] = 3.0
    lift_mm: Annotated[
        float, Ge(1), Le(100), MM, Help(tr("How far above the plate the tip comes and goes."))
    ] = 10.0

    def problems(self, check: Check) -> Iterator[Problem]:
        if self.clearance_mm >= self.lift_mm:
            other = check.spell("lift_mm")
            yield Problem("clearance_mm", tr("must be smaller than {other}", other=other))

    def no_residual(self) -> str:
        return tr("cannot be judged: two touches cannot check each other")
