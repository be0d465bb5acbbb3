"""How the offset of each tool went over its changes, and what that says about the cell.

Reads the record alone; nothing is asked of a controller.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.drift.cell import CellDrift as CellDrift
    from robolink.drift.cell import drift_of as drift_of
    from robolink.drift.charts import Chart as Chart
    from robolink.drift.charts import ChartPoint as ChartPoint
    from robolink.drift.charts import charts_of as charts_of
    from robolink.drift.findings import DriftCode as DriftCode
    from robolink.drift.findings import DriftFinding as DriftFinding
    from robolink.drift.findings import findings_in as findings_in
    from robolink.drift.history import KINDS as KINDS
    from robolink.drift.history import MeasuredChange as MeasuredChange
    from robolink.drift.history import measured_changes as measured_changes
    from robolink.drift.statements import last_statements as last_statements
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "cell": "CellDrift drift_of",
            "charts": "Chart ChartPoint charts_of",
            "findings": "DriftCode DriftFinding findings_in",
            "history": "KINDS MeasuredChange measured_changes",
            "statements": "last_statements",
        },
    )
