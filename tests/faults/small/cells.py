"""Cells of both kinds whose driver uses a wire that is examined frame by frame."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final

import pytest
from robolink_simulators.hosting.in_process.transport import InProcessTransport

from robolink.checkpoints import Checkpoint, observed
from robolink.transport import LinkUrl, _registry
from tests._commands import Ended
from tests.faults._epson_recipe_cell import EpsonRecipeCell
from tests.faults._recipe_cell import RecipeCell
from tests.faults._softmotion_recipe_cell import PlcRecipeCell
from tests.faults.small.modbus_far_end import open_wired, plc_wire
from tests.faults.small.wire import TextLines, Wire

_NUMBER: Final = re.compile(r"-?\d+(\.\d+)?")
_WORDS: Final = ("calibrate", "two-pose", "--tool", "1", "--yes", "--json")


class WiredEpsonCell(EpsonRecipeCell):
    """An EPSON controller behind a wire."""

    def __init__(self) -> None:
        super().__init__((1,))
        self.wire = Wire(self.simulator, TextLines())

    def shape(self, request: bytes) -> str:
        """Return a request without its numbers; a password is hidden."""
        text = request.decode("ascii").strip()
        return "$Login" if text.startswith("$Login") else _NUMBER.sub("#", text)

    def open(self, link_url: LinkUrl, **_: Any) -> InProcessTransport:
        """Connect over the wire."""
        return InProcessTransport(link_url, self.wire, self.clock, self.simulator.lock)

    def rest(self) -> None:
        """Wait as long as the last movement may take in Power Low."""
        self.clock.advance(60.0)
        self.simulator.advance(self.clock.now_ns())


class WiredPlcCell(PlcRecipeCell):
    """A PLC behind a wire that carries Modbus."""

    def __init__(self) -> None:
        super().__init__((1,))
        self.wire = plc_wire(self.simulator, self.clock)

    def shape(self, request: bytes) -> str:
        """Return the simulator's name for the request, without its numbers."""
        return _NUMBER.sub("#", _shown(request))

    def open(self, link_url: LinkUrl, **_: Any) -> object:
        """Connect over the wire."""
        return open_wired(link_url, self.simulator, self.wire, self.clock)

    def rest(self) -> None:
        """Wait half a second, after which a PLC halts an unwatched movement, and for the halt."""
        self.clock.advance(1.0)
        self.simulator.advance(self.clock.now_ns())


def _shown(request: bytes) -> str:
    from robolink_simulators.softmotion.mailbox.exchange import shown_read, shown_write
    from robolink_simulators.softmotion.mailbox.simulator import _opcode_name

    function = request[7]
    address, count = int.from_bytes(request[8:10]), int.from_bytes(request[10:12])
    if function != 16:
        return shown_read(address, count)
    words = [int.from_bytes(request[n : n + 2]) for n in range(13, len(request), 2)]
    return shown_write(address, words, _opcode_name(words))


KINDS: Final[dict[str, type[WiredEpsonCell] | type[WiredPlcCell]]] = {
    "EPSON": WiredEpsonCell,
    "PLC": WiredPlcCell,
}


@contextmanager
def wired_cell(kind: str) -> Iterator[WiredEpsonCell | WiredPlcCell]:
    """Serve a cell; its name leads to its wire in this process."""
    cell = KINDS[kind]()
    scheme = cell.url.partition("://")[0]
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(_registry._loaded, scheme, cell.open)
        try:
            yield cell
        finally:
            cell.close()


@dataclass
class Steps:
    """The place in a calibration: the phase, the step of the procedure, the change.

    Attributes:
        now: The present step, in words.
    """

    phase: str = "before"
    step: str = ""
    request: str = ""

    @property
    def now(self) -> str:
        """The present step, in words."""
        return ", ".join(word for word in (self.phase, self.step, self.request) if word)

    def see(self, point: Checkpoint, what: str) -> None:
        """Follow the checkpoints of the driver and the runner."""
        if point is Checkpoint.PROCEDURE:
            self._changing(_NUMBER.sub("#", what).partition(" (")[0].partition(" XY")[0])
        elif point is Checkpoint.STEP:
            self.step, self.request = what, ""
            if self.phase == "writing":
                self.phase = "proving"
        elif point is Checkpoint.QUESTION:
            self.request = "on the pin" if what == "done" else "asked"

    def _changing(self, request: str) -> None:
        if request.startswith("calibrate"):
            self.phase = "measuring"
        elif "TLSet" in request or "WRITE_TOOL" in request:
            self.phase, self.step = "writing", ""
        self.request = request


def calibrated(cell: RecipeCell, steps: Steps) -> Ended:
    """Run one whole two-pose calibration with its write and its turn test, as a script would."""
    with observed(steps.see):
        return cell.run(*_WORDS, "--assist", cell.url)
