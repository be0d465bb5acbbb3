"""For whoever brings a kind of controller or a method: what it is held to, and what to try it with.

The checks are plain functions; any test framework, or none, can call them. They are the bar for the
kinds of this package too (``tests/contract/test_controller_contract.py``).
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.testing.compared_map import confirm_whole_map as confirm_whole_map
    from robolink.testing.memory_controller import MemoryController as MemoryController
    from robolink.testing.memory_controller import MemoryMachine as MemoryMachine
    from robolink.testing.motion_checks import MOVING_CHECKS as MOVING_CHECKS
    from robolink.testing.motion_checks import (
        WRITING_WHILE_MOVING_CHECKS as WRITING_WHILE_MOVING_CHECKS,
    )
    from robolink.testing.on_site import kept_on_site as kept_on_site
    from robolink.testing.paper_cell import PaperCell as PaperCell
    from robolink.testing.reading_checks import READING_CHECKS as READING_CHECKS
    from robolink.testing.subject import Check as Check
    from robolink.testing.subject import ContractBrokenError as ContractBrokenError
    from robolink.testing.subject import Subject as Subject
    from robolink.testing.suite import CheckOutcome as CheckOutcome
    from robolink.testing.suite import check_controller as check_controller
    from robolink.testing.suite import outcomes as outcomes
    from robolink.testing.tool_checks import WRITING_CHECKS as WRITING_CHECKS
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "compared_map": "confirm_whole_map",
            "memory_controller": "MemoryController MemoryMachine",
            "motion_checks": "MOVING_CHECKS WRITING_WHILE_MOVING_CHECKS",
            "on_site": "kept_on_site",
            "paper_cell": "PaperCell",
            "reading_checks": "READING_CHECKS",
            "subject": "Check ContractBrokenError Subject",
            "suite": "CheckOutcome check_controller outcomes",
            "tool_checks": "WRITING_CHECKS",
        },
    )
