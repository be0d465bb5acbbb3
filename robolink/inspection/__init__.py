"""A look at a whole cell that moves nothing: is it as the last change left it, is anything due.

For a job that runs every night, and for whoever comes to a cell in the morning
(docs/accuracy.md).
"""

from robolink.inspection._looking import (
    Inspection,
    InspectionCode,
    InspectionFinding,
    inspect,
    measured_findings,
)

__all__ = [
    "Inspection",
    "InspectionCode",
    "InspectionFinding",
    "inspect",
    "measured_findings",
]
