"""Two crossed light beams through which a program moved its tip, edge by edge."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar, Final

from robolink.errors import CalibrationError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, angle_difference_deg
from robolink.serving._beam_round import BeamRound, require_promised, round_crossings
from robolink.serving._callback_limits import CallbackLimits, require_poses_sent, require_room

if TYPE_CHECKING:
    from robolink.calibration import CalibrationResult, Crossing, VerifyResult
    from robolink.methods.beams.crossings import CrossingSolver
    from robolink.stations import BeamStation


LEAST_OF_A_ROUND: Final = 4
"""Number of crossings in one round: each beam in both directions. One round is enough, because the
shaft is crossed too and shares its lags: two residuals could contradict the result."""

_STEP_MM: Final = 0.001
"""How finely a line tells where an edge was, in mm."""

LEAST_TURN_DEG: Final = 60.0
"""Smallest turn, degrees: from 60 degrees on, a turn test shows beams that were moved by e as a
drift of e or more: 2 e sin(turn / 2)."""

LEAST_SHAFT_MM: Final = 1.0
"""Smallest extra depth at which the shaft is crossed, in mm, so that its lean shows."""

_ONE_DEPTH_MM: Final = 0.2
_ONE_ANGLE_DEG: Final = 1.0


@dataclass(slots=True)
class _Travels:
    """Crossings in the order in which they came, and the last edge at which the tip entered."""

    crossings: "list[Crossing]" = field(default_factory=list)
    entered: tuple[int, Pose] | None = None

    def edge(self, beam: int, flange: Pose, *, broken: bool) -> int:
        from robolink.calibration import Crossing

        if (self.entered is None) is not broken or (self.entered and self.entered[0] != beam):
            raise CalibrationError("edge_order", tr("The edges of a beam came in the wrong order."))
        if self.entered is None:
            require_room(len(self.crossings))
            self.entered = beam, flange
        else:
            self.crossings.append(Crossing(beam, self.entered[1], flange))
            self.entered = None
        return len(self.crossings)

    def require(self, least: int) -> None:
        if self.entered is not None:
            raise CalibrationError("edge_order", tr("The tip was left in a beam."))
        require_poses_sent(len(self.crossings), least)


class ProgramCrossings:
    """Edges of two beams, solved as by ``calibrate beams``; implements ``ProgramMeasure``.

    Each pose is followed by the number of the beam, 1 or 2, and what its input showed before the
    travel and shows now, 1 for on. An edge at which it did not change was not seen.

    Args:
        station: Where the beams are, and how their inputs switch.
        limits: What the crossings are held to.
        max_lean_deg: Largest angle at which the shaft may lean.
    """

    length: ClassVar[int] = 3
    by_contact: ClassVar[bool] = False

    def __init__(
        self, station: "BeamStation", limits: CallbackLimits, *, max_lean_deg: float
    ) -> None:
        self._station, self._limits, self._max_lean_deg = station, limits, max_lean_deg
        self._measured, self._proving = _Travels(), _Travels()
        self._rounds: list[BeamRound] = []

    def add(self, flange: Pose, seen: Sequence[str], *, proof: bool) -> int:
        """Add an edge; see ``ProgramMeasure``.

        Raises:
            CalibrationError: ``no_edge``, ``edge_order`` or ``too_many_poses``.
            RemoteProtocolError: There is no such beam, or no such state of an input.
        """
        beam, before, now = seen
        if beam not in ("1", "2") or not {before, now} <= {"0", "1"}:
            raise RemoteProtocolError(tr("{fields} is not an edge.", fields=",".join(seen)))
        if before == now:
            raise CalibrationError("no_edge", tr("Input of beam {beam} did not switch.", beam=beam))
        broken = (now == "1") is not self._station.off_when_broken
        return self._travels(proof=proof).edge(int(beam) - 1, flange, broken=broken)

    def add_round(self, driven: BeamRound, flange_of: Callable[[Pose], Pose]) -> int:
        """Add a round that the program drove by itself; return how many crossings there are now.

        Args:
            driven: What it reports.
            flange_of: Returns the flange's pose for one in the tool of the round.

        Raises:
            CalibrationError: Those of :func:`~robolink.serving._beam_round.require_promised` and
                :func:`~robolink.serving._beam_round.round_crossings`; ``too_many_poses``.
        """
        require_promised(driven)
        travels, count = self._travels(proof=driven.proof), 0
        self._rounds.append(driven)
        for one in round_crossings(driven, self._station):
            travels.edge(one.beam, flange_of(one.entry), broken=True)
            count = travels.edge(one.beam, flange_of(one.exit), broken=False)
        return count

    def _travels(self, *, proof: bool) -> _Travels:
        return self._proving if proof else self._measured

    def solve(self, stored: ToolOffset) -> "CalibrationResult":
        """Return the offset; see ``ProgramMeasure``.

        Crossings at two angles of U rely on the directions of the beams only. X and Y are those of
        the end of the needle, corrected by how its shaft leans.

        Raises:
            CalibrationError: ``too_few_poses``, ``shaft_not_crossed``, ``uneven_depth``,
                ``bent_needle``, ``one_direction``, and those of
                :func:`~robolink.calibration.solve_crossed_beams`.
        """
        from robolink.calibration import MIN_ROTATION_DEG, angle_spread_deg
        from robolink.methods.beams.crossings import require_straight

        self._measured.require(LEAST_OF_A_ROUND)
        crossings, shaft = _by_depth(self._measured.crossings)
        require_poses_sent(len(crossings), LEAST_OF_A_ROUND)
        solver = self._solver(crossings[0].entry, stored)
        deeper_mm = _deeper_mm(crossings, shaft)
        spread_deg = angle_spread_deg([_heading_deg(one.entry) for one in crossings])
        moved = spread_deg >= MIN_ROTATION_DEG
        result = solver.solved(crossings, shaft, deeper_mm=deeper_mm, moved=moved)
        require_straight(result, self._max_lean_deg)
        return _both_ways(result)

    def prove(self, result: "CalibrationResult", written: ToolOffset) -> "VerifyResult":
        """Return where crossings at another U see the new tip; see ``ProgramMeasure``.

        Raises:
            CalibrationError: ``too_few_poses``, ``insufficient_rotation``, ``one_direction``, and
                those of :func:`~robolink.calibration.solve_crossed_beams`.
        """
        from robolink.calibration import (
            BeamsResult,
            Drift,
            FlangePlane,
            VerifyResult,
            moved_beams,
        )

        self._proving.require(LEAST_OF_A_ROUND)
        crossings = self._proving.crossings
        _require_turned([one.entry for one in crossings], result.inputs)
        drifts = []
        for heading_deg in _headings(crossings):
            seen = [one for one in crossings if _is_at(one, heading_deg)]
            solver = self._solver(seen[0].entry, written)
            off_mm = written.x_mm, written.y_mm
            if isinstance(result, BeamsResult):
                solver = replace(solver, beams=moved_beams(solver.beams, result.moved_mm))
                if result.lean is not None:
                    off_mm = solver.seen_mm(written, result.lean)
            found = _both_ways(solver.solved(seen)).offset
            plane = FlangePlane.of(seen[0].entry)
            off_mm = (found.x_mm - off_mm[0], found.y_mm - off_mm[1])
            drifts.append(Drift(seen[0].entry.u_deg, *plane.in_base(*off_mm)))
        return VerifyResult(tuple(drifts), self._limits.tolerance_mm)

    def from_place(
        self,
        result: "CalibrationResult",  # noqa: ARG002 - other measures need it
        written: ToolOffset,  # noqa: ARG002
        proof: "VerifyResult",
    ) -> "VerifyResult":
        """Return the turn test, which already counts from there; see ``ProgramMeasure``."""
        return proof

    def on_record(self) -> Mapping[str, object]:
        """Return what was measured; see ``ProgramMeasure``."""
        return {
            "crossings": [
                {"beam": one.beam + 1, "entry": _plain(one.entry), "exit": _plain(one.exit)}
                for one in self._measured.crossings
            ],
            "rounds": [one.on_record() for one in self._rounds],
        }

    def _solver(self, frame: Pose, expected: ToolOffset) -> "CrossingSolver":
        from robolink.calibration import FlangePlane
        from robolink.methods.beams.crossings import CrossingSolver

        station = self._station
        tip_z_mm = frame.z_mm + FlangePlane.of(frame).rise_mm(expected)
        dip_mm = station.z_mm - tip_z_mm
        return CrossingSolver(
            station.beams, frame, dip_mm, expected, self._limits.sigma_mm, _STEP_MM
        )


def _deeper_mm(crossings: "Sequence[Crossing]", shaft: "Sequence[Crossing]") -> float:
    """Return how much deeper the shaft was crossed; it shows where the end of a needle is.

    Raises:
        CalibrationError: ``shaft_not_crossed``, ``too_few_poses``.
    """
    if len(shaft) < LEAST_OF_A_ROUND or len(_headings(shaft)) > 1:
        raise CalibrationError(
            "shaft_not_crossed",
            tr(
                "The shaft was not crossed {depth:g} mm deeper, each beam both ways.",
                depth=LEAST_SHAFT_MM,
            ),
        )
    (heading_deg,) = _headings(shaft)
    beside = [one for one in crossings if _is_at(one, heading_deg)]
    require_poses_sent(len(beside), LEAST_OF_A_ROUND)
    return beside[0].entry.z_mm - shaft[0].entry.z_mm


def _by_depth(crossings: "Sequence[Crossing]") -> "tuple[list[Crossing], list[Crossing]]":
    """Return the crossings of the tip and the deeper ones, of the shaft.

    Raises:
        CalibrationError: ``uneven_depth``.
    """
    highest_mm = max(one.entry.z_mm for one in crossings)
    depths_mm = [highest_mm - one.entry.z_mm for one in crossings]
    tip = [one for one, mm in zip(crossings, depths_mm, strict=True) if mm < LEAST_SHAFT_MM]
    shaft = [one for one, mm in zip(crossings, depths_mm, strict=True) if mm >= LEAST_SHAFT_MM]
    for group in filter(None, (tip, shaft)):
        heights_mm = [pose.z_mm for one in group for pose in (one.entry, one.exit)]
        if max(heights_mm) - min(heights_mm) > _ONE_DEPTH_MM:
            raise CalibrationError("uneven_depth", tr("The tip crossed the beams unequally deep."))
    return tip, shaft


def _both_ways(result: "CalibrationResult") -> "CalibrationResult":
    if "one_direction" in result.warnings:
        raise CalibrationError("one_direction", tr("A beam was crossed in one direction only."))
    return result


def _require_turned(poses: Sequence[Pose], measured: Sequence[Pose]) -> None:
    """Refuse a test at the angle of the measurement: moved beams would look the same there."""
    turns_deg = [
        abs(angle_difference_deg(_heading_deg(one), _heading_deg(other)))
        for one in poses
        for other in measured
    ]
    if min(turns_deg) < LEAST_TURN_DEG:
        raise CalibrationError(
            "insufficient_rotation",
            tr("The turn test has to differ by {least:g} degrees of U.", least=LEAST_TURN_DEG),
        )


def _heading_deg(pose: Pose) -> float:
    from robolink.calibration import FlangePlane

    return FlangePlane.of(pose).heading_deg


def _is_at(crossing: "Crossing", heading_deg: float) -> bool:
    away_deg = angle_difference_deg(_heading_deg(crossing.entry), heading_deg)
    return abs(away_deg) < _ONE_ANGLE_DEG


def _headings(crossings: "Sequence[Crossing]") -> list[float]:
    """Return the angles of the crossings, each once."""
    found: list[float] = []
    for crossing in crossings:
        if not any(_is_at(crossing, heading_deg) for heading_deg in found):
            found.append(_heading_deg(crossing.entry))
    return found


def _plain(pose: Pose) -> list[float]:
    return list(astuple(pose)[:6])
