"""Possible faults: vocabulary, plans, plans drawn from a seed, files, disks.

The numbers (F25) are those of docs/reference/faults.md; docs/fault-plans.md is for users.
"""

from robolink_simulators.faults.counted import CountedFaults, Planned
from robolink_simulators.faults.disk import DiskFault, FaultyDisk
from robolink_simulators.faults.drawn import FaultRates, drawn_faults, drawn_plc_faults
from robolink_simulators.faults.fieldbus import PlcFault, PlcFaultAction
from robolink_simulators.faults.links import (
    FaultNotPossibleError,
    LinkKind,
    links_of,
    require_possible,
)
from robolink_simulators.faults.plan import Departure, FaultPlan
from robolink_simulators.faults.plan_file import (
    FaultFile,
    fault_as_keys,
    faults_of_table,
    read_fault_file,
)
from robolink_simulators.faults.stream import Fault, FaultAction

__all__ = [
    "CountedFaults",
    "Departure",
    "DiskFault",
    "Fault",
    "FaultAction",
    "FaultFile",
    "FaultNotPossibleError",
    "FaultPlan",
    "FaultRates",
    "FaultyDisk",
    "LinkKind",
    "Planned",
    "PlcFault",
    "PlcFaultAction",
    "drawn_faults",
    "drawn_plc_faults",
    "fault_as_keys",
    "faults_of_table",
    "links_of",
    "read_fault_file",
    "require_possible",
]
