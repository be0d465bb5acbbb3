"""The adversary: whole cells in virtual time, random disturbances, rules checked throughout.

One seed is one history of one cell: an EPSON controller or a PLC, its world, a PC with a disk, two
people with habits, and their disturbances. Driver, codec, journal, transaction and nozzle change
are the real ones; time, chance, the disk and the order of threads come from the seed
(docs/decisions/0026-a-machine-that-looks-for-defects.md). The same seed gives the same event log,
byte for byte, in every process; :attr:`Story.hash` covers all of it.

::

    python -m tests.soak.adversary --seeds 0-499     # run a range, or go on with it
    python -m tests.soak.adversary --seeds fresh     # seeds that were never run
    python -m tests.soak.adversary --seed 7 --replay # tell one, event by event
    python -m tests.soak.adversary --seed 7 --shrink --write-test tests/soak/test_found_7.py
    python -m tests.soak.adversary                   # the sums so far

In Python, also with a defect put in on purpose::

    story = run(7, hours=20, replacements={"robolink.stop_latch.StopLatch.admit": lambda *_: None})
    story.broken        # rules that did not hold, each with its name, its hour and what was seen
    print(story.told())

The modules: :mod:`.drawn_hours` draws the events, :mod:`.history` holds and prints them,
:mod:`.history_run` and :mod:`.cell` run a history and shorten one that breaks a rule.
:mod:`.people` act, :mod:`.rules` judge by readings of :mod:`.plant` and :mod:`.books` that bypass
the driver; :mod:`.surroundings` has the time, the chance, the locks and the turns, :mod:`.computer`
the PC and its disk; ``seed_records`` keeps sums and all seeds ever run. :mod:`.line_run` runs the
lines that :mod:`.command_lines` draws, :mod:`.call_watch` compares each call with the machine.
"""

from collections.abc import Mapping

from tests.soak.adversary.drawn_hours import drawn_history as drawn_history
from tests.soak.adversary.history import CellKind as CellKind
from tests.soak.adversary.history import History as History
from tests.soak.adversary.history import Story as Story
from tests.soak.adversary.history_run import live_through as live_through


def run(
    seed: int,
    hours: int = 20,
    *,
    kind: CellKind | None = None,
    replacements: Mapping[str, object] | None = None,
) -> Story:
    """Run the history of a seed and return how it went.

    Args:
        seed: Decides everything: the cell, its people, the disturbances, and their times.
        hours: Virtual hours, each with one deed and one disturbance at least.
        kind: The kind of cell; by default the seed decides.
        replacements: Objects to put in place of dotted names during the run: defects that the
            rules have to find.
    """
    return live_through(drawn_history(seed, hours, kind), replacements)
