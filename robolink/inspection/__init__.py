"""A check of whole cells that moves nothing: is each as it was left, is anything due.

For a job that runs every night, and for whoever comes to a cell in the morning
(docs/accuracy.md). Many cells are checked at once. What was interrupted at a cell is finished or
undone by one call, too.
"""

from robolink.inspection._cell_checks import check_cell, check_cells
from robolink.inspection._cell_recovery import CellRecovery, recover_cell
from robolink.inspection._check_record import record_check
from robolink.inspection._check_results import CellCheck, CheckFailure, CheckState
from robolink.inspection._inspection import (
    Inspection,
    InspectionCode,
    InspectionFinding,
    inspect,
    measured_findings,
)

__all__ = [
    "CellCheck",
    "CellRecovery",
    "CheckFailure",
    "CheckState",
    "Inspection",
    "InspectionCode",
    "InspectionFinding",
    "check_cell",
    "check_cells",
    "inspect",
    "measured_findings",
    "record_check",
    "recover_cell",
]
