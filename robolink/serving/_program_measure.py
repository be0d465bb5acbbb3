"""What a program may measure with, its accuracy in a cell, and the limits of its turn test."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar, Protocol

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.serving._callback_limits import CallbackLimits
from robolink.stations import StationKind, find_stations

if TYPE_CHECKING:
    from robolink.accuracy import Recall
    from robolink.calibration import AccuracyFacts, CalibrationResult, VerifyResult
    from robolink.config import Cell
    from robolink.stations import Station


class ProgramMeasure(Protocol):
    """What one calibration of a program measures and tests with.

    Attributes:
        length: How many fields follow a pose.
        by_contact: Whether an input showed each touch, so that nobody had to see it.
    """

    length: ClassVar[int]
    by_contact: ClassVar[bool]

    def add(self, flange: Pose, seen: Sequence[str], *, proof: bool) -> int:
        """Add a flange pose and what was seen there; return how many there are now.

        Raises:
            CalibrationError: It is refused.
            RemoteProtocolError: It makes no sense.
        """

    def solve(self, stored: ToolOffset) -> "CalibrationResult":
        """Return the measured offset; what is not measured is kept from ``stored``.

        Raises:
            CalibrationError: Nothing trustworthy follows; its code says why.
        """

    def prove(self, result: "CalibrationResult", written: ToolOffset) -> "VerifyResult":
        """Return what was seen after the write about the new offset.

        Raises:
            CalibrationError: It is no proof; its code says why.
        """

    def from_place(
        self, result: "CalibrationResult", written: ToolOffset, proof: "VerifyResult"
    ) -> "VerifyResult":
        """Return a turn test as drifts from the measured or known place."""

    def on_record(self) -> Mapping[str, object]:
        """Return what was measured, plain JSON."""


def measure_named(
    name: str, limits: CallbackLimits, station: Callable[[str, StationKind], "Station"]
) -> ProgramMeasure:
    """Return a program's choice: a method, and behind ``@`` its station.

    Args:
        name: ``n-angle``, ``pivot``, ``camera``, or ``beams@STATION``.
        limits: What its measurement is held to.
        station: Finds a station of the program's controller.

    Raises:
        CalibrationError: ``unknown_method``.
        ConfigError: There is no such station, or nobody knows where it is.
    """
    from robolink.serving._camera_measure import ProgramLooks
    from robolink.serving._pin_measure import touches_by

    method, at, place = name.partition("@")
    if method == "beams" and place:
        from robolink.methods.beams import BeamsParameters
        from robolink.serving._beam_measure import ProgramCrossings
        from robolink.stations import beam_station

        beams = beam_station(station(place, StationKind.BEAMS))
        return ProgramCrossings(beams, limits, max_lean_deg=BeamsParameters().max_lean_deg)
    if at or method not in ("n-angle", "pivot", "camera"):
        raise CalibrationError(
            "unknown_method", tr("There is no calibration method {name!r}.", name=name)
        )
    if method == "camera":
        return ProgramLooks(limits)
    return touches_by(method, limits)


def facts_for_program(
    recall: "Recall",
    cell: "Cell | None",
    result: "CalibrationResult",
    measure: "ProgramMeasure",
    station: str = "",
) -> "AccuracyFacts":
    """Return what a cell knows of the rows of what a program measured.

    Args:
        recall: What is on record of its controller.
        cell: The cell; ``None`` where none is named.
        result: What was measured.
        measure: What it measured with.
        station: The station that the program named; empty for none.
    """
    from dataclasses import replace

    from robolink.accuracy import CellRecord, LooksAlike, facts_at, stated_rows

    record = CellRecord(recall)
    known = find_stations(cell, record.stations).get(station)
    facts = facts_at(
        record,
        station=station,
        stated=stated_rows(cell, known or station),
        alike=LooksAlike(station, result.method, by_contact=measure.by_contact),
        learnt=known is not None and known.learnt,
        inputs_per_look=result.inputs_per_look,
    )
    return replace(facts, by_program=True)


def statements_on_record(result: "CalibrationResult") -> dict[str, object]:
    """Return a result's accuracy as the journal stores it, plain JSON."""
    return {
        "known_within_mm": result.repeatable_to_mm,
        "repeatable_to_mm": result.repeatable_to_mm,
        "accurate_to_mm": result.accurate_to_mm,
        "accuracy": result.accuracy.as_json(result.measured) if result.accuracy else None,
        "warnings": list(result.warnings),
    }


def proved(
    measure: "ProgramMeasure",
    result: "CalibrationResult",
    written: ToolOffset,
    facts: "AccuracyFacts",
) -> "VerifyResult":
    """Return the turn test of a written value; refuse one that contradicts its measurement.

    A contradiction of the scatter alone passes where what it shows lies within what the result is
    accurate to; nobody looks on who could be asked (docs/reference/evidence.md 20).

    Args:
        measure: What was measured, and seen after the write.
        result: What was measured, with what it is accurate to.
        written: The value that was written.
        facts: What the cell knows of the rows of its budget.

    Raises:
        CalibrationError: ``drift``, ``proof_contradicts_accuracy``,
            ``proof_contradicts_repeatability``, or as :meth:`ProgramMeasure.prove`.
    """
    from dataclasses import replace

    from robolink.calibration import held_to_claim, turn_claim

    proof = measure.prove(result, written)
    if not proof.passed:
        raise CalibrationError(
            "drift",
            tr("The tip is {drift:.3f} mm off when the tool turns.", drift=proof.max_drift_mm),
        )
    claim = turn_claim(result, facts)
    if claim is None:
        return proof
    judgement = held_to_claim(claim, measure.from_place(result, written, proof))
    if judgement.fails:
        raise CalibrationError(
            judgement.code,
            tr(
                "The turn test contradicts the measurement: {drift:.3f} mm off, and "
                "{limit:.3f} mm are explained.",
                drift=proof.max_drift_mm,
                limit=judgement.limits[judgement.worst].accurate_mm,
            ),
        )
    return replace(proof, warnings=(*proof.warnings, *judgement.codes))
