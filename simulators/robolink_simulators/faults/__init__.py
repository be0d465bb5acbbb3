"""What can be planned to go wrong: vocabulary, plans, plans drawn from a seed, files, disks.

The numbers (F25) are those of docs/reference/faults.md; docs/fault-plans.md is for users.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink_simulators.faults.counted import CountedFaults as CountedFaults
    from robolink_simulators.faults.counted import Planned as Planned
    from robolink_simulators.faults.disk import DiskFault as DiskFault
    from robolink_simulators.faults.disk import FaultyDisk as FaultyDisk
    from robolink_simulators.faults.drawn import FaultRates as FaultRates
    from robolink_simulators.faults.drawn import drawn_faults as drawn_faults
    from robolink_simulators.faults.drawn import drawn_plc_faults as drawn_plc_faults
    from robolink_simulators.faults.fieldbus import PlcFault as PlcFault
    from robolink_simulators.faults.fieldbus import PlcFaultAction as PlcFaultAction
    from robolink_simulators.faults.links import FaultNotPossibleError as FaultNotPossibleError
    from robolink_simulators.faults.links import LinkKind as LinkKind
    from robolink_simulators.faults.links import links_of as links_of
    from robolink_simulators.faults.links import require_possible as require_possible
    from robolink_simulators.faults.plan import Departure as Departure
    from robolink_simulators.faults.plan import FaultPlan as FaultPlan
    from robolink_simulators.faults.plan_file import FaultFile as FaultFile
    from robolink_simulators.faults.plan_file import fault_as_keys as fault_as_keys
    from robolink_simulators.faults.plan_file import faults_of_table as faults_of_table
    from robolink_simulators.faults.plan_file import read_fault_file as read_fault_file
    from robolink_simulators.faults.stream import Fault as Fault
    from robolink_simulators.faults.stream import FaultAction as FaultAction
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "counted": "CountedFaults Planned",
            "disk": "DiskFault FaultyDisk",
            "drawn": "FaultRates drawn_faults drawn_plc_faults",
            "fieldbus": "PlcFault PlcFaultAction",
            "links": "FaultNotPossibleError LinkKind links_of require_possible",
            "plan": "Departure FaultPlan",
            "plan_file": "FaultFile fault_as_keys faults_of_table read_fault_file",
            "stream": "Fault FaultAction",
        },
    )
