"""The adversary: whole cells in virtual time against seeded disturbances.

Work in progress notes: see :func:`run`.
"""

from collections.abc import Mapping

from robolink_simulators.soak.cell import live_through
from robolink_simulators.soak.history import CellKind, History
from robolink_simulators.soak.story import Story


def run(
    seed: int,
    hours: int = 20,
    *,
    kind: CellKind | None = None,
    replacements: Mapping[str, object] | None = None,
) -> Story:
    """Run the history of a seed and return how it went.

    Args:
        seed: Decides everything: the cell, its people, what gets in the way, and when.
        hours: Virtual hours, each with one change and one disturbance at least.
        kind: What stands in the cell; by default the seed decides.
        replacements: Objects to put in place of what dotted names lead to, meanwhile.
    """
    return live_through(History.drawn(seed, hours, kind), replacements)
