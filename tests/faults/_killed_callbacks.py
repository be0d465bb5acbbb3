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
from tests.faults._recipe_instants import (
    EVERYTHING,
    Instant,
    Instants,
    exchanges_and_commits,
    noted,
)

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
        folder: For the program.
        refused: Whether a touch of the turn test misses the pin.
    """

    def __init__(self, kind: type[CallbackCell], folder: Path, *, refused: bool = False) -> None:
        self.cell = cell = kind(folder, in_process=True)
        cell.calls.far = lambda: _MortalPc(cell.conversation("the program"))
        cell.change_needle()
        if refused:
            cell.teach(22, PROVED[1:], off_mm=1.0)
        self._old = cell.tool
        self._dead = pytest.MonkeyPatch()

    def run(self, instants: Instants) -> list[str] | None:
        """Run the program; return what it printed, if its controller lived."""
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
                self._dead.undo()

    def cut_power(self) -> None:
        """Let the controller go."""
        raise PowerCut

    def end_pc(self) -> None:
        """Let the PC go."""

        @contextmanager
        def written(*_given, **_room):
            raise PcGone
            yield

        self._dead.setattr(Store, "write", written)
        raise PcGone

    def check(self, printed: list[str] | None) -> str:
        """Check the leftovers, and go on; return whether the old value or the new one stands."""
        cell = self.cell
        if printed is not None:
            # A dead process holds no lease; this one goes on.
            log = cell.journal.log(IDENTITY)
            log.take_over("the PC was switched off")
            log.close()
        cell.restore()
        whole = cell.require_whole(self._old)
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
        return "new" if whole else "old"


def lose(
    begin: Callable[[], MortalCell], gone: str, *, everywhere: bool, refused: bool
) -> set[str]:
    """Lose controller or PC at its instants, or at a sample; return how the changes ended.

    Until its verdict, a change that is refused is like one that is kept; the sample leaves its
    statements before that out. Of the PC's transactions it has both moments in turn.

    Args:
        begin: Opens a cell.
        gone: What is lost, "power" or "PC".
        everywhere: Whether to lose it at each instant.
        refused: Whether the undisturbed change is refused.
    """
    power, instants = gone == "power", Instants()
    mortal = begin()
    assert mortal.run(instants) == ["touches_not_witnessed" if refused else "kept"]
    mortal.cell.close()
    of_power = Statements(everywhere, _VERDICT if refused else "")
    comes = of_power if power else partial(_is_of_pc, everywhere)
    comes_at = list(filter(comes, instants.passed))
    print(f"{gone}: {len(comes_at)} kill points of {len(instants.passed)}")  # noqa: T201 - for pytest -s
    ends = set[str]()
    for at in comes_at:
        mortal = begin()
        with noted(at):
            printed = mortal.run(Instants(at, mortal.cut_power if power else mortal.end_pc))
            ends.add(mortal.check(printed))
        mortal.cell.close()
    return ends


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
