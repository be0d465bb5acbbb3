"""A whole ``robolink calibrate two-pose`` that is killed on its way.

Nothing is written that was not asked for, the next command says that Tool 0 is still selected and
names the old tool, and ``recover`` restores it.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Final

from robolink.model import EntryKind, ToolOffset
from tests.faults._epson_recipe_cell import EpsonRecipeCell
from tests.faults._kills import kill
from tests.faults._nozzle_cell import OF_A_CALIBRATION, numbers
from tests.faults._recipe_instants import EVERYTHING, Instant, Instants
from tests.faults._requests import changes

_EVERY: Final = 48
"""Every 48th of all other exchanges is in the sample."""

_MATTERS: Final = re.compile(r'\$(Log|Execute,"Tool \d)')
"""Requests that log in or out, or select."""

_MOVES: Final = re.compile(r'\$Execute,"(Move |Go )')
_EVERY_MOVE: Final = 7
"""Every seventh moment of movements, most of which are the jogs of one touch."""

_WRITES: Final = re.compile(r'\$Execute,"TLSet \d')


class Dealt:
    """Chooses the instants of a share: all of them, or, without the switch, a fixed sample.

    The sample has both moments of a write, and one of each other exchange.

    Args:
        share: Its number, from 0, or several.
        shares: The number of shares.
        every_commit: One in so many durable transactions of the journal is in the sample, with the
            instants before and after it; 0 for none.
    """

    def __init__(self, *share: int, shares: int, every_commit: int = 0) -> None:
        self._share, self._shares = share, shares
        self._every_commit = every_commit
        self._moves = 0
        self._chosen = 0

    def __call__(self, at: Instant) -> bool:
        """Whether the program is disturbed there."""
        if at.kind not in ("request", "answer", "commit") or not self._in_sample(at):
            return False
        self._chosen += 1
        return self._chosen % self._shares in self._share

    def _in_sample(self, at: Instant) -> bool:
        if EVERYTHING or _WRITES.match(at.what):
            return True
        if at.kind == "commit":
            return bool(self._every_commit) and at.number % self._every_commit == 1
        if _MOVES.match(at.what):
            self._moves += 1
            return self._moves % _EVERY_MOVE == 1
        moment = ("request", "answer")[at.number % 2]
        return at.kind == moment and (bool(_MATTERS.match(at.what)) or at.number % _EVERY == 1)


def words(cell: EpsonRecipeCell) -> tuple[str, ...]:
    """Return the command of the whole nozzle change."""
    return ("calibrate", "two-pose", "--tool", "1", "--yes", "--assist", cell.url)


@contextmanager
def begun() -> Iterator[EpsonRecipeCell]:
    """Open the cell of a run."""
    cell = EpsonRecipeCell((1,))
    try:
        yield cell
    finally:
        cell.close()


def die(
    words: Callable[[EpsonRecipeCell], Sequence[str]],
    dies: Callable[[Instant], bool],
    check: Callable[[EpsonRecipeCell, Sequence[str]], object],
) -> None:
    """Run a command, let it die at some of its instants, and check the leftovers."""
    instants = Instants()
    with begun() as cell:
        ended = cell.run(*words(cell), instants=instants)
        assert ended.code == 0, ended.err
    dies_at = list(filter(dies, instants.passed))
    print(f"{len(dies_at)} kill points of {len(instants.passed)}")  # noqa: T201 - for pytest -s
    assert dies_at
    for at in dies_at:
        with begun() as cell:
            command = words(cell)
            kill(
                lambda life: cell.run(*command, instants=life),  # noqa: B023 - called at once
                at,
                partial(check, cell, command),
            )


def check_killed(cell: EpsonRecipeCell) -> None:
    """Check the leftovers, recover, and go on."""
    cell.come_to_rest()
    moves_begun = cell.moves_begun
    check_nothing_else_was_written(cell)
    assert len(cell.writes()) <= 1
    check_the_next_command_says_what_is_selected(cell)
    check_recover_puts_the_cell_s_own_tool_back(cell)
    assert cell.moves_begun == moves_begun
    cell.check_motion_is_allowed()
    assert cell.moves_begun == moves_begun + 1


def check_nothing_else_was_written(cell: EpsonRecipeCell) -> None:
    """Tool 1 holds the old or the measured value, written once at most; the rest is unchanged."""
    asked = changes(cell.requests())
    strange = [text for text in asked if not OF_A_CALIBRATION.fullmatch(text)]
    assert not strange, strange
    written = [ToolOffset(*numbers(text)) for text in asked if "TLSet" in text]
    assert len(cell.writes()) == len(written) <= 2
    assert cell.tools() == {**cell.before, 1: written[-1] if written else cell.before[1]}
    assert cell.outputs() == cell.outputs_before
    assert cell.moves_begun <= cell.moves_asked()


def check_the_next_command_says_what_is_selected(cell: EpsonRecipeCell) -> None:
    """The selected tool is named beside the earlier one, with the way to restore it."""
    markers = cell.open_markers()
    shown = cell.run("status")
    assert shown.code == 0, shown.err
    if cell.selected != 1:
        assert "Tool 0 is selected now; it was tool 1 before" in shown.err
        assert "This restores tool 1, with the earlier power mode and speed" in shown.err
    assert shown.err.count(f'robolink -c "{cell.url}" recover') == len(markers)
    assert cell.open_markers() == markers


def check_recover_puts_the_cell_s_own_tool_back(cell: EpsonRecipeCell) -> None:
    """Tool, power and speed are the earlier ones, and an unverified value is undone."""
    recovered = cell.run("recover", "--yes")
    assert recovered.code == 0, recovered.err
    assert (cell.selected, cell.settings()) == (1, cell.settings_before)
    assert cell.open_markers() == ()
    check_nothing_else_was_written(cell)
    kept = list(cell.journal.entries(kinds=(EntryKind.DONE,)))
    assert (not cell.changed()) is not bool(kept), "what nobody verified is taken back"
