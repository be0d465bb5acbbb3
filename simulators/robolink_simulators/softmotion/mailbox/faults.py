"""The faults of a mailbox under the name of their device; see ``robolink_simulators.faults``."""

from robolink_simulators.faults.fieldbus import PlcFault as PlcFault
from robolink_simulators.faults.fieldbus import PlcFaultAction as PlcFaultAction
