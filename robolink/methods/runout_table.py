"""runout-table: a calibrated camera sees how the tip wobbles, angle by angle."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Annotated, ClassVar, cast

from annotated_types import MaxLen, MinLen

from robolink.calibration import Sighting
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.camera import CameraSource
from robolink.methods.method import DEGREES, Angle, Check, Help, Method, Needs, Option, Site
from robolink.methods.shared_parameters import (
    PLACE,
    UNMEASURED_Z,
    LookParameters,
    camera_at,
)
from robolink.model import Pose, ToolOffset, checks_arguments
from robolink.procedures import LookPlan, ProofBasis
from robolink.runner import Procedure
from robolink.sensing import sensor_name
from robolink.stations import CameraStation, StationKind

if TYPE_CHECKING:
    from robolink.calibration import RunoutTableResult
    from robolink.methods.camera import LookTest
    from robolink.procedures import KeptProof, TipSource


LARGEST_GAP_DEG = 60.0
"""Largest gap between neighbouring angles, degrees; the solver has the same limit."""

_LEAST_LOOKS = 8


@dataclass(frozen=True, slots=True)
class AllRoundPlan(LookPlan):
    """Looks all round, within half a turn to either side of U = 0, the range of wrists.

    They begin at the end that is nearer and go on from neighbour to neighbour, so that every turn
    but the first is small and the first less than half a turn.
    """

    def angles_deg(self, u_deg: float) -> tuple[float, ...]:
        """Return U of every look for a tool that stands at ``u_deg``, in order."""
        # In the range from -180, exclusive, to 180.
        within = [180.0 - (180.0 - u_deg - turn_deg) % 360.0 for turn_deg in self.turns_deg]
        return tuple(sorted(within, reverse=u_deg > 0))


@dataclass(frozen=True, kw_only=True)
class RunoutTableParameters(LookParameters):
    """How a calibrated camera looks at a tip all round."""

    plan_kind: ClassVar[type[LookPlan]] = AllRoundPlan

    turns_deg: Annotated[
        tuple[Angle, ...],
        MinLen(_LEAST_LOOKS),
        MaxLen(72),
        DEGREES,
        Option(flag="--angles", metavar="0,30,.."),
        Help(
            declared(
                "U of each look, relative to the present U: all round, in steps of 60 or less. "
                "Each becomes a row of the table."
            )
        ),
    ] = tuple(30.0 * step for step in range(12))

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


@dataclass(frozen=True, slots=True)
class RunoutTableSource(CameraSource):
    """Measures X and Y of a tip by looking at it all round, and how it wobbles."""

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: seen all round by the camera {sensor}, at {count} angles of U",
            sensor=sensor_name(self.sensor),
            count=len(self.plan.turns_deg),
        )

    def solved(
        self,
        seen: Sequence[Sighting],
        marks: Sequence[int],  # noqa: ARG002 - there is one
        stored: ToolOffset | None,
    ) -> "RunoutTableResult":
        """Solve the looks at the tip."""
        from robolink.calibration import solve_runout_table  # numpy

        return solve_runout_table(
            seen, stored=stored, sigma_mm=self.sigma_mm, camera=self.station.model
        )

    def proof_of(self, basis: ProofBasis) -> "LookTest":
        """Return the test at other angles, where the tip must be where the table says."""
        from robolink.calibration import RunoutTableResult  # numpy
        from robolink.methods.runout_table_procedure import WobbleTest

        # "slots" creates the class anew, so the short form of super() would not find it.
        looks = CameraSource.proof_of(self, basis)
        if not isinstance(basis.result, RunoutTableResult):
            return looks
        plain = {field.name: getattr(looks, field.name) for field in fields(looks)}
        return WobbleTest(**plain, table=basis.result.table)


@checks_arguments
def measure_runout_table(
    station: CameraStation,
    plan: LookPlan,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    retake: bool = False,
) -> "Procedure[RunoutTableResult]":
    """Measure X and Y of a tip and how it wobbles, with a calibrated camera. Runs in Tool 0.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: At which angles it is looked at: all round, in steps of 60 degrees at most.
        here: Where the flange is; its U is where the angles count from.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.

    Raises:
        CalibrationError: As :func:`measure_camera`, and those of :func:`solve_runout_table`.

    Example:
        >>> from robolink.methods import RunoutTableParameters, measure_runout_table
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> camera, here = CameraStation(x_mm=300, y_mm=80, z_mm=-30), Pose(300, 100, 20, 0)
        >>> plan = RunoutTableParameters(turns_deg=tuple(range(0, 360, 45))).look
        >>> stored = ToolOffset(12, -3.5, -20)
        >>> course = measure_runout_table(camera, plan, here=here, stored=stored)
        >>> found = PaperCell(here, ToolOffset(12.1, -3.2, -20)).run(course)
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3), len(found.inputs)
        (12.1, -3.2, 8)
    """
    source = RunoutTableSource("", station, plan, sigma_mm, retake)
    return cast("Procedure[RunoutTableResult]", source.procedure(stored, here))


def _source(parameters: RunoutTableParameters, site: Site) -> "TipSource":
    sensor, station = camera_at(parameters, site)
    return RunoutTableSource(
        sensor, station, parameters.look, sigma_mm=site.sigma_mm, retake=parameters.retake
    )


def _proof() -> "type[KeptProof]":
    from robolink.methods.runout_table_procedure import WobbleTest

    return WobbleTest


METHOD = Method(
    name="runout-table",
    summary=declared("Measure pick-nozzle runout: X and Y, and a table by angle."),
    description=declared(
        "See the tip with a calibrated, up-looking camera all round: X and Y, and a table of "
        "how far off the tip is at each angle of U; nobody touches anything.\n\nThe table is "
        "for nozzles with runout. The journal and the JSON document contain it. The controller "
        "has no place for it, so the program that places parts must apply it. robolink "
        "proposes only X and Y for writing."
    ),
    parameters=RunoutTableParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.CAMERA, sensor=True, place=PLACE),
    source=_source,
    unmeasured_z=UNMEASURED_Z,
    proof=_proof,
)
