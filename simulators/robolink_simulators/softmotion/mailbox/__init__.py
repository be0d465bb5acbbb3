"""The mailbox program of a simulated SoftMotion PLC (docs/reference/mailbox.md). SIMULATED."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names
from robolink_simulators.softmotion.mailbox.exchange import ServedAccess
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.mailbox.options import MailboxOptions
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

__all__ = [
    "MailboxOptions",
    "PlcOptions",
    "ServedAccess",
    "SoftMotionSimulator",
]

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
