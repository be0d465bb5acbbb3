"""A restore from a backup that is killed on its way: writes, selects, clears, in this order.

The steps done by then stay, and nothing else is done until somebody runs the restore again, which
completes it: each tool is written or cleared once.
"""

from typing import Final

from robolink.model import ToolOffset
from tests.faults._change_cell import ChangeCell
from tests.faults._change_process import NEW, OLD
from tests.faults._kill_points import NOTHING_LEFT

Stage = tuple[dict[int, ToolOffset | None], int]

STAGES: Final[tuple[Stage, ...]] = (
    ({**OLD}, 1),
    ({**OLD, 2: NEW[2]}, 1),
    ({**OLD, 2: NEW[2]}, 2),
    ({1: None, 2: NEW[2]}, 2),
)
"""The tools' values and the selected tool, step by step."""

_FORGOTTEN_S: Final = 11.0
"""After this time a PLC no longer counts the killed program as owner of its mailbox."""


def stage(cell: ChangeCell) -> Stage:
    """Return the present state, past the wire."""
    return cell.tools, cell.selected


def check_killed_restore(cell: ChangeCell) -> None:
    """Check the leftovers of a killed restore, recover, and run it again, twice."""
    cell.act()
    stands = stage(cell)
    assert stands in STAGES
    cell.check_what_was_acknowledged_is_there()
    cell.recover()
    assert NOTHING_LEFT in cell.recover()
    assert stage(cell) == stands
    cell.skip(_FORGOTTEN_S)
    for _ in range(2):
        cell.deliver("restore")
        assert stage(cell) == STAGES[-1]
    assert cell.writes() == [2, 1]
    assert cell.journal.open_markers() == ()
