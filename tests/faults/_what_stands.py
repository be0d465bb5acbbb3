"""Commands with one disturbance, whose output is compared with the facts.

A disturbance hits one exchange, or the journal from one durable transaction on; the simulator has
the facts, past the wire.
"""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pytest
from robolink_simulators.faults import Fault, FaultAction, PlcFault, PlcFaultAction

from robolink.journal.store.store import Store, Tables
from robolink.model import EntryKind, MarkerKind
from tests._commands import Ended
from tests.faults._epson_recipe_cell import EpsonRecipeCell
from tests.faults._recipe_cases import CASES, Case
from tests.faults._recipe_cell import RecipeCell
from tests.faults._softmotion_recipe_cell import PlcRecipeCell


@dataclass(frozen=True)
class Command:
    """One command on one kind of controller."""

    case: Case
    words: tuple[str, ...]

    def run(self, cell: RecipeCell, folder: Path) -> Ended:
        """Run it as a script would, with documents on stdout."""
        recipe = folder / "recipe.toml"
        recipe.write_text(self.case.recipe)
        words = [word.format(recipe=recipe, assist=cell.url) for word in self.words]
        return cell.run(*words, "--json")


_SET: Final = ("tool", "set", "1", "--x", "12.5", "--yes")
_RECALIBRATE: Final = ("recalibrate", "{recipe}", "--assist", "{assist}")

COMMANDS: Final = {
    f"{kind}: {name}": Command(case, words if name == "tool set" else (*words, *case.answers))
    for kind, case in (("EPSON", CASES["EPSON, one tool"]), ("PLC", CASES["PLC, one tool"]))
    for name, words in (("tool set", _SET), ("recalibrate", _RECALIBRATE))
}

WIRE: Final = ("DROP_REPLY", "GARBLE_REPLY", "DISCONNECT", "DISCONNECT_BEFORE")
JOURNAL: Final = ("once", "from then on")


@dataclass(frozen=True)
class Disturbed:
    """One disturbance: its kind, and its exchange or transaction, counted from 0."""

    how: str
    number: int

    @contextmanager
    def on(self, cell: RecipeCell) -> Iterator[None]:
        """Apply it."""
        if self.how in JOURNAL:
            with commits(self._refused):
                yield
            return
        if isinstance(cell, EpsonRecipeCell):
            cell.simulator.faults.add(Fault(FaultAction[self.how], on_exchange=self.number))
        elif isinstance(cell, PlcRecipeCell):
            cell.simulator.faults.add(PlcFault(PlcFaultAction[self.how], on_exchange=self.number))
        yield

    def _refused(self, number: int) -> bool:
        return number == self.number if self.how == "once" else number >= self.number


@contextmanager
def commits(refused: Callable[[int], bool]) -> Iterator[list[int]]:
    """Count the durable transactions of the journal, and make SQLite refuse the given ones."""
    write, seen = Store.write, list[int]()

    @contextmanager
    def watched(store: Store, what: str = "", then: str = "", **room: int) -> Iterator[Tables]:
        number = len(seen)
        seen.append(number)
        with write(store, what, then, **room) as tables:
            if not refused(number):
                yield tables
                return
            tables.connection.run("PRAGMA query_only=ON")
            try:
                yield tables
            finally:
                tables.connection.run("PRAGMA query_only=OFF")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Store, "write", watched)
        yield seen


def whole_run(command: Command, folder: Path) -> tuple[list[str], int]:
    """Run a command undisturbed; return its requests, and its number of transactions."""
    with command.case.cell() as cell, commits(lambda _number: False) as seen:
        ended = command.run(cell, folder)
        assert ended.code == 0, ended.err
        assert cell.changed() == {1}
        return cell.requests(), len(seen)


def check(command: Command, disturbed: Disturbed, folder: Path) -> str:
    """Disturb a run and compare its output with the facts; return how it ended."""
    with command.case.cell() as cell:
        with disturbed.on(cell):
            ended = command.run(cell, folder)
        if ended.code == 0:
            assert cell.changed() == {1}
            assert cell.selected == 1
            return "done"
        _check_the_document(cell, ended, json.loads(ended.out), disturbed)
        return f"exit {ended.code}"


def _check_the_document(
    cell: RecipeCell, ended: Ended, document: dict[str, Any], disturbed: Disturbed
) -> None:
    said, stands = document["error"]["controller_state"], document["error"]["stands"]
    assert document["exit_code"] == ended.code
    written, selected = bool(cell.changed()), cell.selected
    kept = any(e.kind is EntryKind.DONE for e in cell.journal.entries(kinds=(EntryKind.DONE,)))
    if written:
        assert said != "unchanged", ended.out
        # A tested and confirmed value may stay; the error came after it.
        assert ended.code == 6 or kept, ended.out
    if said == "unchanged":
        assert (written, selected) == (False, 1), ended.out
    if said == "changed" and "1" in stands["tools"]:
        assert stands["tools"]["1"]["known"]
        holds = cell.tools()[1]
        assert holds is not None
        components = tuple(stands["tools"]["1"]["holds"].values())
        assert components == pytest.approx(holds.components(), abs=1e-3), ended.out
    if stands["selected_tool"] is not None and disturbed.how != "GARBLE_REPLY":
        assert stands["selected_tool"] == selected, ended.out
    assert (ended.code == 6) is not stands["settled"], ended.out
    open_markers = cell.open_markers()
    unproved = [marker for marker in open_markers if marker.kind is not MarkerKind.SELECTION]
    assert (ended.code == 6) is bool(unproved), (ended.out, open_markers)
    assert stands["left_open"] is bool(open_markers), (ended.out, open_markers)
    if said == "unknown":
        assert ended.code == 6, ended.out
