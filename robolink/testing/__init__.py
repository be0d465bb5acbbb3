"""Contract tests for a new kind of controller or method, and a cell on paper to try it with.

The checks are plain functions; any test framework, or none, can call them. They are the bar for the
kinds of this package too (``tests/contract/test_controller_contract.py``).
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names
from robolink.testing.motion_checks import MOVING_CHECKS, WRITING_WHILE_MOVING_CHECKS
from robolink.testing.on_site import kept_on_site
from robolink.testing.paper_cell import PaperCell
from robolink.testing.reading_checks import READING_CHECKS
from robolink.testing.subject import Check, ContractBrokenError, Subject
from robolink.testing.suite import CheckOutcome, check_controller, confirm_whole_map, outcomes
from robolink.testing.tool_checks import WRITING_CHECKS

__all__ = [
    "Check",
    "CheckOutcome",
    "ContractBrokenError",
    "MOVING_CHECKS",
    "PaperCell",
    "READING_CHECKS",
    "Subject",
    "WRITING_CHECKS",
    "WRITING_WHILE_MOVING_CHECKS",
    "check_controller",
    "confirm_whole_map",
    "kept_on_site",
    "outcomes",
]

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
