"""A cell in this process on which whole recipes run, and the checks after a mishap."""

import io
import re
import sys
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from itertools import count
from typing import ClassVar, Final

import pytest
from robolink_simulators.device.wire_record import WireRecord
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.journal import Journal, memory_journal
from robolink.model import Marker, ToolOffset
from tests._commands import Ended, run_command
from tests.faults._recipe_instants import (
    Instants,
    WatchedClock,
    exchanges_and_commits,
    questions,
)

_names = count()

_BY_THE_STOP: Final = "The emergency stop may have switched outputs off"
_SWITCHED: Final = re.compile(
    r"(?:Outputs stay as the recipe switched them|"
    rf"{_BY_THE_STOP}; the recipe had switched): ([^.]*)\."
)


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class RecipeCell(ABC):
    """A controller of some kind with its nozzles changed, tool 1 selected.

    Attributes:
        disturbances: The possible disturbances besides Ctrl-C.
        before: The tools' earlier values.
        shows_its_tool: Whether it shows which tool is selected in every state.
        clock: The clock of all parts.
        url: Of the controller.
        assist: Of the simulated person, if that is another one.
        recipe_tools: The tools that the recipe changes.
        switched: The outputs that the run switched, with their last state, past the wire.
    """

    disturbances: ClassVar[tuple[str, ...]]
    shows_its_tool: ClassVar[bool]
    before: Mapping[int, ToolOffset]

    def __init__(
        self, simulator: EpsonSimulator | SoftMotionSimulator, recipe_tools: Sequence[int]
    ) -> None:
        self.recipe_tools = recipe_tools
        self.clock = WatchedClock()
        self.name = f"recipes-{next(_names)}"
        self.switched: dict[int, bool] = {}
        self._hosted = simulator
        simulator.log = WireRecord(most=None)  # all of it, however long a run is
        self.assist = ""
        self.url = self._register()
        self.journal: Journal = memory_journal(self.url.partition("?")[0])
        self.outputs_before = self.outputs()
        self.settings_before = self.settings()

    @abstractmethod
    def _register(self) -> str:
        """Serve it and return its URL."""

    @abstractmethod
    def _unregister(self) -> None:
        """Stop serving it."""

    def close(self) -> None:
        """Stop serving it, and drop its journal."""
        self._unregister()
        self.journal.close()

    @abstractmethod
    def tools(self) -> dict[int, ToolOffset | None]:
        """Return the stored values of the recipe's tools, past the wire."""

    @property
    @abstractmethod
    def selected(self) -> int:
        """The selected tool, past the wire."""

    @abstractmethod
    def settings(self) -> object:
        """Return the other settings that a procedure must restore."""

    @abstractmethod
    def outputs(self) -> Mapping[int, bool]:
        """Return the state of the outputs that recipes switch."""

    @abstractmethod
    def sent_as(self, number: int, on: bool) -> str:
        """Return the request that switches an output, as its marker has it."""

    @property
    @abstractmethod
    def moving(self) -> bool:
        """Whether the robot moves."""

    @abstractmethod
    def where(self) -> object:
        """Return the flange pose, past the wire."""

    @abstractmethod
    def writes(self) -> list[int]:
        """Return the tools written so far, in order, as the controller counts them."""

    @abstractmethod
    def moves_asked(self) -> int:
        """Return the number of movements requested so far."""

    @property
    @abstractmethod
    def moves_begun(self) -> int:
        """The number of movements begun so far, past the wire."""

    @abstractmethod
    def strange(self) -> list[str]:
        """Return requests that no run of a recipe may send."""

    @abstractmethod
    def stops_asked(self) -> int:
        """Return the number of stops requested so far."""

    @abstractmethod
    def disturb(self, how: str) -> None:
        """Disturb the run."""

    @abstractmethod
    def make_ready(self, how: str) -> None:
        """Undo the disturbance, and do at the command line what a person does then."""

    def changed(self) -> set[int]:
        """Return the tools whose values have changed."""
        return {tool for tool, held in self.tools().items() if held != self.before[tool]}

    def check_outputs_are_named(self, said: str, *, early: bool) -> None:
        """What the end of a run says of outputs.

        It names each that the run left otherwise than before, and none but its own. Once the run
        has acted on the cell, it mentions that the controller may have switched more by itself.

        Args:
            said: How the run ended.
            early: Whether it ended with an error.
        """
        words = " ".join(said.split())
        left = _SWITCHED.search(words)
        found = re.findall(r"(\d+) (on|off)", left[1] if left else "")
        named = {int(number): state == "on" for number, state in found}
        unproved = {marker.request for marker in self.open_markers()}  # these are named, too
        for number, on in named.items():
            doubtful = self.sent_as(number, not on) in unproved  # known is the state before it
            assert self.switched.get(number) is on or doubtful, (named, self.switched, said)
        for number, on in self.switched.items():
            known = named.get(number) is on or self.sent_as(number, on) in unproved
            known = known or self._told_as_carried_out(words, number) is on
            assert known or on is self.outputs_before[number], (number, on, said)
        by_itself = self.outputs() != {**self.outputs_before, **self.switched}
        if early and by_itself and (self.switched or self.moves_asked()):
            assert _BY_THE_STOP in words, said

    def _told_as_carried_out(self, words: str, number: int) -> bool | None:
        """Return the last state of an output in the list of requests that stands at such an end."""
        _, _, told = words.rpartition("This was carried out: ")
        # A request may be the beginning of the other one, so the longer match goes first.
        last_on = told.rfind(self.sent_as(number, True))
        last_off = told.rfind(self.sent_as(number, False))
        return None if max(last_on, last_off) < 0 else last_on >= last_off

    def check_motion_is_allowed(self) -> None:
        """A movement starts again when it is requested."""
        asked = self.moves_asked()
        for words in (("motors", "on", "--yes"), ("jog", "z+0.5", "--yes")):
            assert (done := self.run(*words)).code == 0, done.err
        assert self.moves_asked() == asked + 1

    def come_to_rest(self) -> None:
        """Let a movement without a client end."""
        while self.moving:
            self.clock.sleep(0.1)
            self._hosted.advance(self.clock.now_ns())

    def requests(self) -> list[str]:
        """Return the requests so far."""
        return [text for _, direction, text in self._hosted.log if direction == ">"]

    def open_markers(self) -> tuple[Marker, ...]:
        """Return the open markers."""
        return tuple(marker for _, marker in self.journal.open_markers())

    def run(self, *words: str, instants: Instants | None = None, asks: bool = False) -> Ended:
        """Run a command.

        Args:
            words: The command.
            instants: Sees every instant of it.
            asks: Whether a person sits at a terminal and confirms everything.
        """
        seen = Instants() if instants is None else instants
        simulator = self._hosted
        with (
            questions(seen),
            exchanges_and_commits(simulator, seen),
            pytest.MonkeyPatch.context() as patch,
        ):
            patch.setattr(sys, "stdin", (_Terminal if asks else io.StringIO)())
            # A run is repeated up to each of its instants: the same one.
            patch.setattr("robolink.procedures.witnessed_touches.fresh_seed", lambda: 7)
            patch.setattr(self.clock, "on_wait", lambda: seen.pass_by("wait"))
            err = _Terminal() if asks else None
            return run_command("-c", self.url, *words, err=err)
