"""How the offset of each tool changed over time, and what that says about the cell.

Reads the record alone; nothing is asked of a controller.
"""

from robolink.drift.charts import Chart, ChartPoint, charts_of
from robolink.drift.findings import (
    CellDrift,
    DriftCode,
    DriftFinding,
    drift_of,
    findings_in,
    last_statements,
)
from robolink.drift.history import KINDS, MeasuredChange, measured_changes

__all__ = [
    "CellDrift",
    "Chart",
    "ChartPoint",
    "DriftCode",
    "DriftFinding",
    "KINDS",
    "MeasuredChange",
    "charts_of",
    "drift_of",
    "findings_in",
    "last_statements",
    "measured_changes",
]
