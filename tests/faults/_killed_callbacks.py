"""A change by the controller's own program, with the controller or the PC lost in the middle.

The controller loses its power at a statement of the companion, or the answering PC dies before or
after it stores something. After RobolinkRestore the tool is the old one, or a tested one; no later
start touches it; and the next calibration finishes or undoes open changes.
"""

from collections.abc import Callable
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

import pytest
from robolink_simulators.testkit.program_calls import AnsweredHere

from robolink.journal.store.store import Store
from tests.faults._callback_cell import IDENTITY, PROVED, CallbackCell, PowerCut
from tests.faults._recipe_instants import EVERYTHING, Instant, Instants, exchanges_and_commits
from tests.faults._worlds import Worlds

_MATTERS = ("rl_flag =", "TLSet n", "JUDGE", "KEPT,", "WROTE", "RlPutBack", "RESTORED,")
_VERDICT = "JUDGE,"
_COMPANION = "recal.prg:"


class PcGone(BaseException):
    """The process of the server ends here."""


class _MortalPc(AnsweredHere):
    """Answers until its process ends; then nothing cleans up."""

    def ask(self, question):
        with suppress(PcGone):
            return super().ask(question)
        self.close = lambda: None
        return b""


class MortalCell:
    """A cell of some kind, of which controller or PC is lost once.

    Args:
        kind: Measures with a pin, with beams, or with a camera.
        folder: For the program, and for its end in each world.
        refused: Whether a touch of the turn test misses the pin.
    """

    def __init__(self, kind: type[CallbackCell], folder: Path, *, refused: bool = False) -> None:
        self.cell = cell = kind(folder, in_process=True)
        cell.calls.far = lambda: _MortalPc(cell.conversation("the program"))
        cell.change_needle()
        if refused:
            cell.teach(22, PROVED[1:], off_mm=1.0)
        self._old = cell.tool
        self._printed = ["touches_not_witnessed" if refused else "kept"]
        self._begins = _VERDICT if refused else ""
        self._ends = folder / "ends"
        self._dead = pytest.MonkeyPatch()

    def lose(self, gone: str, *, everywhere: bool) -> set[str]:
        """Lose it at its instants, or at a sample of them; return how the changes ended.

        Until its verdict, a change that is refused is like one that is kept; the sample leaves its
        statements before that out. Of the PC's transactions it has both moments in turn.
        """
        power = gone == "power"
        worlds = Worlds(
            Statements(everywhere, self._begins) if power else partial(_is_of_pc, everywhere),
            self._cut_power if power else self._end_pc,
        )
        printed = worlds.explore_ends(lambda: self._run(worlds), self._check)
        assert printed == self._printed
        assert not worlds.told, worlds.told[0]
        print(f"{gone}: {len(worlds.came_at)} kill points of {len(worlds.passed)}")  # noqa: T201 - for pytest -s
        return set(self._ends.read_text().split())

    def _run(self, instants: Instants) -> list[str] | None:
        cell = self.cell
        with exchanges_and_commits(cell.simulator, instants):
            cell.runner.on_statement = lambda _task, file, line, text: instants.pass_by(
                "statement", f"{file}:{line} {text}"
            )
            try:
                printed: list[str] = cell.run()
                return printed
            except PowerCut:
                cell.lose_power()
                return None
            finally:
                cell.runner.on_statement = None

    def _cut_power(self, _at: Instant) -> None:
        raise PowerCut

    def _end_pc(self, _at: Instant) -> None:
        @contextmanager
        def written(*_given, **_room):
            raise PcGone
            yield

        self._dead.setattr(Store, "write", written)
        raise PcGone

    def _check(self, printed: list[str] | None) -> None:
        cell = self.cell
        self._dead.undo()
        if printed is not None:
            # A dead process holds no lease; in this world its process goes on.
            log = cell.journal.log(IDENTITY)
            log.take_over("the PC was switched off")
            log.close()
        cell.restore()
        whole = cell.require_whole(self._old)
        with self._ends.open("a") as ends:
            ends.write("new\n" if whole else "old\n")
        machine = cell.simulator.machine
        tools, held, by_hand = machine.tools, cell.tool, cell.simulator.world.tips[1]
        tools.set(1, by_hand)
        cell.restore()
        assert cell.tool == by_hand
        tools.set(1, held)
        cell.change_needle()
        assert cell.run() == ["kept"]
        assert cell.open_markers() == []
        assert cell.journal.verify().problems == ()


def _is_of_pc(everywhere: bool, at: Instant) -> bool:
    """Whether a PC is gone at an instant: the first before it stores, the second after it, ..."""
    return at.kind == "commit" and (everywhere or EVERYTHING or at.number % 4 in (0, 1))


class Statements:
    """Chooses the significant statements of the companion, or all, each when first reached.

    Args:
        everywhere: Whether to choose all.
        begins: Without it, none before one with this text.
    """

    def __init__(self, everywhere: bool, begins: str = "") -> None:
        everywhere = everywhere or EVERYTHING
        self._chosen: Callable[[str], bool] = (
            bool if everywhere else lambda text: any(w in text for w in _MATTERS)
        )
        self._begins = "" if everywhere else begins
        self._seen = set[str]()

    def __call__(self, at: Instant) -> bool:
        """Whether the power fails there."""
        place, _, text = at.what.partition(" ")
        if at.kind != "statement" or not place.startswith(_COMPANION) or place in self._seen:
            return False
        self._seen.add(place)
        if self._begins in text:
            self._begins = ""
        return not self._begins and self._chosen(text.strip())
