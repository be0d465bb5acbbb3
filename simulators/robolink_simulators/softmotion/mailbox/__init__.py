"""The mailbox program of a simulated SoftMotion PLC (docs/mailbox.md). SIMULATED."""

from robolink_simulators.softmotion.mailbox.faults import PlcFault as PlcFault
from robolink_simulators.softmotion.mailbox.faults import PlcFaultAction as PlcFaultAction
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions as PlcOptions
from robolink_simulators.softmotion.mailbox.options import MailboxOptions as MailboxOptions
from robolink_simulators.softmotion.mailbox.simulator import (
    SoftMotionSimulator as SoftMotionSimulator,
)
from robolink_simulators.softmotion.mailbox.words.exchange import ServedAccess as ServedAccess
