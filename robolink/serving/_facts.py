"""What a cell knows of how sure a program's measurement is, and what goes on record of it."""

from typing import TYPE_CHECKING

from robolink.stations import find_stations

if TYPE_CHECKING:
    from robolink.accuracy import Recall
    from robolink.calibration import AccuracyFacts, CalibrationResult
    from robolink.config import Cell
    from robolink.serving._measures import ProgramMeasure


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
    from robolink.accuracy import CellRecord, LooksAlike, facts_at, stated_rows

    record = CellRecord(recall)
    known = find_stations(cell, record.stations).get(station)
    return facts_at(
        record,
        station=station,
        stated=stated_rows(cell, known or station),
        alike=LooksAlike(station, result.method, by_contact=measure.by_contact),
        learnt=known is not None and known.learnt,
        inputs_per_look=result.inputs_per_look,
    )


def statements_on_record(result: "CalibrationResult") -> dict[str, object]:
    """Return what the journal keeps of how sure a result is, plain JSON."""
    return {
        "known_within_mm": result.repeatable_to_mm,
        "repeatable_to_mm": result.repeatable_to_mm,
        "accurate_to_mm": result.accurate_to_mm,
        "accuracy": result.accuracy.as_json(result.measured) if result.accuracy else None,
        "warnings": list(result.warnings),
    }
