"""A look at a whole cell that moves nothing: is it as the last change left it, is anything due.

For a job that runs every night, and for whoever comes to a cell in the morning
(docs/accuracy.md).
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.inspection._findings import Inspection as Inspection
    from robolink.inspection._findings import InspectionCode as InspectionCode
    from robolink.inspection._findings import InspectionFinding as InspectionFinding
    from robolink.inspection._looking import inspect as inspect
    from robolink.inspection._measuring import measured_findings as measured_findings
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "_findings": "Inspection InspectionCode InspectionFinding",
            "_looking": "inspect",
            "_measuring": "measured_findings",
        },
    )
