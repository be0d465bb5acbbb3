"""One cell through its history: people at work, disturbances, and the rules."""

import gc
import os
import random
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final
from unittest import mock

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.faults import DiskFault, FaultyDisk

from robolink.checkpoints import Checkpoint, observed
from robolink.errors import JournalError, NotReadyError, RobolinkError
from robolink.interrupts import EndedBy, Interrupted, one_ending, output_closed
from robolink.model import Controller, ToolOffset
from robolink.runtime import replaced
from robolink.testing import READING_CHECKS, Subject
from robolink.testing import outcomes as outcomes_of
from robolink.timing import NS_PER_S
from robolink.transaction import Wanted, change_tools, recover
from tests.soak.adversary.books import Books
from tests.soak.adversary.call_watch import watched
from tests.soak.adversary.command_lines import STOP, is_stop
from tests.soak.adversary.computer import VirtualComputer, VirtualProcess
from tests.soak.adversary.history import (
    CellKind,
    Deed,
    Disturbance,
    Hindrance,
    History,
    Hour,
    Story,
)
from tests.soak.adversary.line_run import run_line
from tests.soak.adversary.people import AGREE, OTHERS_TOOL, TOOL, describe, habits_in, wish_of
from tests.soak.adversary.plant.epson import PASSWORD
from tests.soak.adversary.plant.kinds import PLANTS
from tests.soak.adversary.plant.machine import PlantMachine, SentRequest
from tests.soak.adversary.plant.program_plant import ProgramPlant
from tests.soak.adversary.rules import Rulebook
from tests.soak.adversary.surroundings import Killed, SeededSurroundings, TurnTaking

_TRIES: Final = 8
"""The number of tries to get a cell going again; each time people look longer."""

_TRIES_TO_TAKE_OVER_S: Final = (75.0, 30.0)
"""Waiting times until a stopped process has lost its login and its lease."""

_PAST_THE_SYSTEM: Final = ("bent", "truncated", "lost")
"""Damage to the journal's file while nobody has it open."""

_ON_WIRE: Final = (
    Hindrance.WIRE,
    Hindrance.LINE,
    Hindrance.MACHINE,
    Hindrance.PENDANT,
    Hindrance.PRODUCTION,
    Hindrance.ANOTHER_CLIENT,
)


class VirtualCell:
    """A machine, a computer, a disk and people, in virtual time.

    Args:
        history: The events.
        folder: An empty folder for its disk.
    """

    # Objects that live as long as :meth:`run`.
    _computer: VirtualComputer
    _books: Books
    _plant: PlantMachine
    _rules: Rulebook

    def __init__(self, history: History, folder: Path) -> None:
        self.story = Story(history)
        self._history = history
        self._clock = ManualClock()
        self._rng = random.Random(f"cell {history.seed}")
        self._turns = TurnTaking(
            self._clock, self._rng, lambda name: self._note(f"-- {name} goes on")
        )
        self._surroundings = SeededSurroundings(self._clock, self._turns, self._rng)
        self._disk = FaultyDisk(folder)
        self._folder = folder
        self._waiting: list[tuple[Disturbance, int]] = []
        self._at_work: VirtualProcess | None = None
        self._others: list[VirtualProcess] = []
        self._only_power_failed = False
        self._hour = history.hours[0] if history.hours else None

    def run(self) -> Story:
        """Run the whole history."""
        with ExitStack() as stack:
            environment = {
                "ROBOLINK_STATE_DIR": str(self._folder / "state"),
                "ROBOLINK_JOURNAL": str(self._folder / "journal.db"),
            }
            stack.enter_context(mock.patch.dict(os.environ, environment))
            stack.enter_context(replaced(self._surroundings))
            stack.enter_context(self._disk)
            stack.enter_context(observed(self._at_checkpoint))
            self._computer = VirtualComputer(self._folder, self._surroundings)
            self._books = Books(self._computer.journal)
            stack.callback(self._books.close)
            self._plant = self._built()
            self._rules = Rulebook(self.story, self._plant, self._books)
            calls = watched(self._rules.contract, lambda: self._turns.current.owner)
            stack.enter_context(calls)
            for hour in self._history.hours:
                self._live_through(hour)
            self._look_for_the_password()
        return self.story

    def _built(self) -> PlantMachine:
        kind, seed = self._history.kind, self._history.seed
        if kind is CellKind.PROGRAM:
            return ProgramPlant(self._clock, self, seed, self._turns)
        return PLANTS[kind](self._clock, self, seed)

    # Events of the machine's wire and of the checkpoints.

    def leaving(self, process: VirtualProcess, sent: SentRequest) -> None:
        """Note and check a request before it leaves; a dead process sends nothing."""
        if not process.alive:
            raise Killed
        self._note(f"p{process.number} > {sent.text}")
        self._rules.leaving(process, sent)

    def given(self, tool: int, value: ToolOffset) -> None:
        """Note and check a value that the machine's own program is about to get."""
        self._note(f"tool {tool} is to hold {value}")
        self._rules.given(tool, value)

    def passed(self, process: VirtualProcess, text: str) -> None:
        """Note a request or an answer on the wire."""
        if not process.alive:
            raise Killed
        if text.startswith("wire received"):
            self._note(f"p{process.number} < {text}")
        self._rules.contract.passed()
        self._pass_point(process, text)

    def _at_checkpoint(self, point: Checkpoint, what: str) -> None:
        process = self._turns.current.owner
        if not isinstance(process, VirtualProcess):
            return
        if not process.alive:
            raise Killed
        self._pass_point(process, f"{point} {what}")
        if what == AGREE and process is self._at_work:
            self._rules.agreed()

    def _pass_point(self, process: VirtualProcess, text: str) -> None:
        if process is self._at_work and self._waiting:
            due = [d for d, left in self._waiting if d.match in text and not left]
            self._waiting = [
                (d, left - (d.match in text))
                for d, left in self._waiting
                if left or d.match not in text
            ]
            for disturbance in due:
                self._happen(process, disturbance, text)
        self._turns.pass_on(exchanged=text.startswith("exchange"))
        if not process.alive:
            raise Killed

    def _note(self, text: str) -> None:
        self.story.note(self._clock.now_ns(), text.replace(str(self._folder), "DISK"))

    # Disturbances.

    def _happen(self, process: VirtualProcess, disturbance: Disturbance, text: str) -> None:
        self._note(f"!! {disturbance} ({text})")
        self.story.met[disturbance.kind] += 1
        match disturbance.kind:
            case Hindrance.STOP:
                self._turns.start("stop", process, lambda: self._stop(process))
            case Hindrance.KILL:
                self._kill(process)
            case Hindrance.POWER_CUT:
                self._cut_power(process)
            case Hindrance.SECOND_PERSON:
                other = self._computer.start("carl")
                self._others.append(other)
                self._turns.start("carl", other, lambda: self._second_person(other))
            case Hindrance.DISK:
                self._disk.begin(DiskFault[disturbance.what])
            case Hindrance.CLOCK:
                self._surroundings.wall_jump_s += disturbance.seconds
            case Hindrance.HAND:
                self._act_by_hand(disturbance)
            case Hindrance.FREEZE:
                self._freeze(process)
            case Hindrance.INTERRUPT:
                if self._turns.current.name == "main":
                    output_closed()

    def _cut_power(self, process: VirtualProcess) -> None:
        self._books.close()
        if self._disk.lies:
            # The disk reported data as kept that it may have lost: the rest is unreliable.
            self._books.trusted = False
        self._only_power_failed = self._books.trusted and not self._history.harms_disk(self._hour)
        process.alive = False
        self._computer.cut_power(self._clock.now_ns(), self._disk, self._rng.getrandbits(32))
        self._kill(process)

    def _kill(self, process: VirtualProcess) -> None:
        process.alive = False
        self._plant.hang_up(process)
        raise Killed

    def _stop(self, process: VirtualProcess) -> None:
        commanded = self._hour is not None and self._hour.deed is Deed.COMMAND
        stopper = process.stopper or (None if commanded else process.controller)
        if stopper is None:
            return
        try:
            stopper.stop()
        except RobolinkError as error:
            self._note(f"stop: {describe(error)}")
            return
        self._note("stop: acknowledged")
        if process.alive:
            process.stopped_ns = self._clock.now_ns()

    def _act_by_hand(self, disturbance: Disturbance) -> None:
        """Let somebody act at the pendant while robolink asks and nothing moves."""
        assert self._hour is not None  # for the type: an hour runs
        if disturbance.what == "select":
            chosen = self._plant.choose_by_hand(disturbance.position or 0)
            if chosen is not None:
                self._rules.hand_chose(chosen)
            return
        tool = next((tool for tool, _ in wish_of(self._hour).typed), TOOL)
        self._rules.hand_typed(tool, self._plant.type_by_hand(tool))

    def _freeze(self, process: VirtualProcess) -> None:
        """Suspend a process until another one has done its work."""
        if self._turns.current.name != "main":
            return
        other = self._computer.start("dora")
        self._others.append(other)
        thread = self._turns.start("dora", other, lambda: self._take_over(other))
        with self._turns.suspended(process):
            self._turns.wait_until(lambda: thread.over)

    def _take_over(self, process: VirtualProcess) -> None:
        """Let somebody else wait, recover the suspended process's jobs, and type a tool."""
        assert self._hour is not None  # for the type: an hour runs
        tool = next((tool for tool, _ in wish_of(self._hour).typed), TOOL)
        for wait_s in _TRIES_TO_TAKE_OVER_S:
            self._surroundings.sleep(wait_s)
            try:
                with self._connected(process) as controller:
                    with suppress(NotReadyError):
                        controller.reset_fault()
                    self._rules.others_settle()
                    recover(controller, keep=False, confirm=self._rules.word_on)
                    held = controller.tools.read(tool)
                    offset = ToolOffset(8.0, -8.0, -float(1 + process.number % 40))
                    self._rules.others_write(process, (tool, offset))
                    change_tools(controller, [Wanted(tool, offset, held)])
                self._note("dora: done")
                break
            except (RobolinkError, KeyboardInterrupt) as error:
                self._note(f"dora: {describe(error)}")
        process.end()

    def _second_person(self, process: VirtualProcess) -> None:
        """Let somebody at another terminal change another tool."""
        try:
            with self._connected(process) as controller:
                held = controller.tools.read(OTHERS_TOOL)
                offset = ToolOffset(7.0, 7.0, -float(1 + process.number % 40))
                self._rules.others_write(process, (OTHERS_TOOL, offset))
                wanted = [Wanted(OTHERS_TOOL, offset, held)]
                change_tools(controller, wanted, tell=self._note_said)
                self._note("carl: done")
        except (RobolinkError, KeyboardInterrupt) as error:
            self._note(f"carl: {describe(error)}")
        finally:
            process.end()

    # An hour.

    def _live_through(self, hour: Hour) -> None:
        self._hour = hour
        self._rng.seed(f"chance {self._history.seed} {hour.number}")
        self.story.begin_hour(hour.number)
        self._clock.advance_to(hour.number * 3600 * NS_PER_S)
        self._note(f"hour {hour.number}: {hour.habit.person} sets out to {hour.deed}")
        self._plant.prepare(habits_in(hour.habit))
        self._harm_the_journal(hour)
        self._rules.begin(hour, wish_of(hour, self._plant.state().tools))
        self._arm(hour)
        self._do(hour)
        for fault in DiskFault:
            self._disk.end(fault)
        self.story.met["wire or machine"] += self._plant.disarm()
        self._waiting = []
        self._settle_down()
        self._rules.left(self._plant.state())
        if hour.habit.impatient and self._books.markers():
            self._note(f"{hour.habit.person} tries again at once")
            self._plant.repair()
            self._rules.begin_again()
            self._do(hour)
            self._settle_down()
            self._rules.left(self._plant.state())
        self._books.lost = False  # the people are told to look, and confirm
        usable, why = self._put_right(hour)
        self._rules.at_rest(self._plant.state(), usable=usable, why=why)
        if usable and not self._plant.calls_back:
            self._hold_to_contract(hour)
        self._note(f"journal {self._books.digest()}")
        self._surroundings.wall_jump_s = 0.0
        self._books.trusted = True
        self._only_power_failed = False

    def _arm(self, hour: Hour) -> None:
        for disturbance in hour.disturbances:
            if disturbance.kind in _ON_WIRE:
                self._plant.arm(disturbance)
            elif disturbance.what not in _PAST_THE_SYSTEM:
                self._waiting.append((disturbance, disturbance.at))
            if disturbance.what == "SYNC_LIES":
                self._disk.begin(DiskFault.SYNC_LIES)

    def _harm_the_journal(self, hour: Hour) -> None:
        for disturbance in hour.disturbances:
            if disturbance.what not in _PAST_THE_SYSTEM or not self._computer.journal.exists():
                continue
            self._note(f"!! {disturbance}")
            self.story.met[disturbance.kind] += 1
            self._books.close()
            # A connection that a killed process dropped is closed when it is collected; until then
            # it holds a lock, and opening what is left of the file would wait for it in real time.
            gc.collect()
            if disturbance.what == "lost":
                self._books.lost = self._computer.known and self._books.last_number() > 0
                self._books.close()
            self._computer.harm(disturbance.what, (disturbance.at % 97) / 97)
            self._books.trusted = False

    def _do(self, hour: Hour) -> None:
        process = self._at_work = self._computer.start(hour.habit.person)
        me = self._turns.current
        me.owner = process
        error: BaseException | None = None
        try:
            commanded = hour.deed is Deed.COMMAND
            with (
                one_ending(),
                nullcontext() if commanded else self._connected(process) as controller,
            ):
                try:
                    if commanded:
                        self._type_line(process, hour)
                    elif controller is not None:
                        self._rules.now.report = self._plant.carry_out(
                            controller, hour, self._note_said
                        )
                except BaseException as raised:
                    error = raised
                    raise
                finally:
                    stopped_ns = process.stopped_ns
        except Killed:
            self._plant.hang_up(process)
        except (Exception, KeyboardInterrupt) as raised:
            error = error or raised
        finally:
            me.owner = None
        if isinstance(error, Interrupted) and error.by is not EndedBy.OUTPUT_CLOSED:
            raise error  # a real one: the person who runs this wants it to end
        if not process.alive:
            self.story.endings[f"{hour.deed}: killed"] += 1
            self._rules.killed()
            self._turns.join()
            process.end()
            self._stop_what_goes_on(hour)
            return
        self._turns.join()
        process.stopped_ns = stopped_ns if error is None and process.controller else None
        self._rules.ended(process, error, self._plant.state())
        how = "done" if error is None else type(error).__name__
        self.story.endings[f"{hour.deed}: {how}"] += 1
        self._note("done" if error is None else describe(error))
        process.end()

    def _type_line(self, process: VirtualProcess, hour: Hour) -> None:
        """Let a command connect as often as it wants to."""

        def connect() -> Controller:
            outcomes = process.log(self._plant.address, self._clock)
            process.controller = self._plant.connect(process, outcomes)
            return process.controller

        self._note("types " + " ".join(hour.line))
        folder = str(self._folder)
        run_line(hour.line, self._plant, process, connect, folder, self._note_said)
        if is_stop(hour.line):
            self._rules.stopped()

    def _stop_what_goes_on(self, hour: Hour) -> None:
        """Let a person stop, from another process, a machine that moves after a process died."""
        self._plant.advance()
        if self._plant.calls_back or not self._plant.moving:
            return
        process = self._turns.current.owner = self._computer.start(hour.habit.person)
        try:
            self._type_line(process, replace(hour, line=STOP))
            self._note("stop: acknowledged")
        except Killed:
            self._plant.hang_up(process)
        except (Exception, KeyboardInterrupt) as error:
            self._note(f"stop: {describe(error)}")
        finally:
            self._turns.current.owner = None
            process.end()

    def _note_said(self, text: str) -> None:
        self._note(f"   {text}")
        self._rules.said(text)

    @contextmanager
    def _connected(self, process: VirtualProcess) -> Iterator[Any]:
        outcomes = process.log(self._plant.address, self._clock)
        with self._plant.connect(process, outcomes) as controller:
            process.controller = controller
            yield controller

    def _settle_down(self) -> None:
        """Let everything under way on the machine end."""
        self._turns.join()
        for process in self._others:
            self._plant.hang_up(process)
        self._others = []
        self._at_work = None
        self._clock.advance(90.0)
        self._plant.advance()

    def _put_right(self, hour: Hour) -> tuple[bool, str]:
        """Let the people get the cell going again; return whether they did, and why not."""
        why = ""
        for attempt in range(_TRIES):
            self._plant.repair()
            process = self._computer.start(hour.habit.person)
            self._turns.current.owner = process
            try:
                with self._connected(process) as controller:
                    if self._plant.put_right(controller, hour.habit, self._note_said):
                        return True, ""
                why = "something stays open"
            except JournalError as error:
                why = describe(error)
                self._note(f"sets the journal aside: {why}")
                self._rules.hold("JournalKept", not self._only_power_failed, why)
                process.end()
                self._books.close()
                self._computer.set_aside()
                self._books.trusted = False
            except RobolinkError as error:
                why = describe(error)
            except Exception as error:
                why = f"{type(error).__name__}: {error}"
                self._rules.hold("NoDefectShown", False, why)
            finally:
                self._turns.current.owner = None
                process.end()
            self._note(f"try {attempt + 1}: {why}")
            self._clock.advance(30.0 * 2**attempt)
            self._plant.advance()
        return False, why

    def _hold_to_contract(self, hour: Hour) -> None:
        """Run one of the shipped checks that only read on the stopped cell, in turn."""
        process = self._turns.current.owner = self._computer.start(hour.habit.person)
        log = partial(process.log, self._plant.address, self._clock)
        subject = Subject(lambda: self._plant.connect(process, log()), tool=2)
        check = READING_CHECKS[hour.number % len(READING_CHECKS)]
        try:
            (found,) = outcomes_of(subject, (check,))
            self._rules.hold("ContractHolds", not found.broken, f"{found.name}: {found.broken}")
        finally:
            self._turns.current.owner = None
            process.end()

    def _look_for_the_password(self) -> None:
        lines = "\n".join(self.story.lines())
        shown = list(self._computer.files_with(PASSWORD))
        self._rules.hold("NoPasswordShown", PASSWORD not in lines and not shown, f"in {shown}")
