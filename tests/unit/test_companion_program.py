"""Programs of the controller: robolink_tools.prg, and a call-back whose record was lost."""

import random
import re
from collections.abc import Mapping
from pathlib import Path
from typing import cast

import pytest
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.condition import Condition
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.variables import Variables
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel.programs.program_load import load_project
from robolink_simulators.epson.spel.session import Session
from robolink_simulators.epson.spel.tasks.ports import Ports
from robolink_simulators.epson.spel.tasks.runner import ProgramRunner
from robolink_simulators.epson.stepped_controller import LAST_COUNT, Companion

from robolink.errors import JournalError, OutcomeUnknownError, RobolinkError
from robolink.journal import Journal
from robolink.model import ToolOffset
from robolink.protocols.spel_callback import CallbackLine, CallbackWord
from robolink.serving import CallbackConversation, CallbackLimits

# robolink_tools.prg is legal SPEL+, and the simulated companion does what it says.
# The program itself runs on the simulated controller, and its stored values are compared with those
# of the simulated companion. Its lines have few forms, every one of which must be known here.

PROGRAM = Path(__file__).parents[2] / "companions" / "epson" / "robolink_tools.prg"
FORBIDDEN = re.compile(
    r"\b(go|move|jump|motor|power|speed|on|off|out|wait|xqt|quit|halt|pause|reset|print|tlclr)\b"
    r"|^\s*(tool|tlset|robot)\b",
    re.IGNORECASE,
)
FORMS = {
    "global": re.compile(r"Global Preserve (Long|Double) (.+)"),
    "local": re.compile(r"(Integer|Long|Double) (.+)"),
    "function": re.compile(r"Function (RobolinkPublish)"),
    "end": re.compile(r"(Fend)"),
    "for": re.compile(r"For (\w+) = (\w+) To (\w+)"),
    "next": re.compile(r"Next (\w+)"),
    "if": re.compile(r"If (.+) Then"),
    "else": re.compile(r"(Else)"),
    "endif": re.compile(r"(EndIf)"),
    "assign": re.compile(r"(\w+)(?:\(([^()]+)\))? = (.+)"),
}
DECLARED = re.compile(r"(\w+)(?:\((\d+)\))?")


def program_lines():
    lines = (line.partition("'")[0].strip() for line in PROGRAM.read_text("ascii").splitlines())
    return [line for line in lines if line]


def formed(line):
    """Return the form of a line and its parts."""
    for form, pattern in FORMS.items():
        match = pattern.fullmatch(line)
        if match:
            return form, match.groups()
    raise AssertionError(f"no form that is known here: {line}")


class Program:
    """The program itself, run by the simulator on a machine; tests read and set its variables."""

    def __init__(self, machine):
        options, condition = EpsonOptions(globals_at_start="kept"), Condition(monitoring_only=False)
        session = Session(machine, options, random.Random(1), condition, Variables("-1"), {})
        project = load_project(session, [PROGRAM])
        self.runner = ProgramRunner(session, condition, project, Ports())
        self.values = Values(project.preserved())

    def call(self):
        self.runner.start("RobolinkPublish", self.runner.now_ns)
        self.runner.advance(self.runner.now_ns + 10**9)
        assert self.runner.failure is None
        assert self.runner.tasks == {}

    def published(self):
        names = ("robolink_begin", "robolink_end", "robolink_state", "robolink_tool")
        return [self.values[name] for name in names]


class Values(Mapping[str, object]):
    """The program's variables: lists for arrays, numbers for the others."""

    def __init__(self, variables):
        self._variables = variables

    def __getitem__(self, name):
        variable = self._variables[name]
        values = [float(value) for value in variable.values]
        return values if variable.bounds else values[0]

    def __setitem__(self, name, value):
        self._variables[name].values[0] = int(value)

    def __iter__(self):
        return iter(self._variables)

    def __len__(self):
        return len(self._variables)


@pytest.fixture
def machine():
    machine = Machine(find_robot("T6-602S"))
    machine.tools.set(1, ToolOffset(12.345, -3.5, -20.002, 90))
    machine.tools.set(15, ToolOffset(0.001, 0, 0, -179.5))
    machine.tools.select(15)
    return machine


def simulated(machine):
    """Return the same variables after a run of the simulator's companion."""
    variables = Variables("-1")
    Companion(machine, variables).publish()
    (begin,), (end,) = (variables.get(f"robolink_{name}", "Long") for name in ("begin", "end"))
    state = variables.get("robolink_state(0)", "Long", "19")
    table = variables.get("robolink_tool(0)", "Double", "90")
    return [float(begin), float(end), [float(n) for n in state], [float(n) for n in table]]


def test_every_line_has_a_form_that_is_known():
    forms = [formed(line)[0] for line in program_lines()]
    assert forms.count("function") == forms.count("end") == 1
    assert forms.count("for") == forms.count("next")
    assert forms.count("if") == forms.count("endif")


def test_nothing_in_it_moves_waits_or_sets_a_tool():
    assert [line for line in program_lines() if FORBIDDEN.search(line)] == []


def test_names_and_arrays_keep_within_the_language_s_bounds():
    for form, parts in map(formed, program_lines()):
        if form in ("global", "local"):
            for name, bound in DECLARED.findall(parts[1]):
                assert len(name) <= 32
                # One GetVariable gives at most 100 elements (docs/reference/epson.md 1.2 note 4).
                assert int(bound or 0) < 100


def test_the_simulated_companion_stores_what_the_program_stores(machine):
    program = Program(machine)
    program.call()
    assert program.published() == simulated(machine)
    assert program.values["robolink_state"][2] == 15
    assert program.values["robolink_tool"][84:90] == [0.001, 0, 0, -179.5, 0, 0]


def test_a_second_call_without_a_change_stores_nothing(machine):
    program = Program(machine)
    program.call()
    program.call()
    assert program.values["robolink_begin"] == program.values["robolink_end"] == 1
    machine.tools.clear(1)
    program.call()
    assert program.values["robolink_begin"] == program.values["robolink_end"] == 2
    assert program.values["robolink_state"][4] == 0


def test_a_call_after_one_that_was_broken_off_makes_the_counts_equal_again(machine):
    program = Program(machine)
    program.call()
    program.values["robolink_begin"] = 2.0
    program.call()
    assert program.values["robolink_begin"] == program.values["robolink_end"] == 3


def test_the_count_starts_again_before_a_long_overflows(machine):
    program = Program(machine)
    program.call()
    program.values["robolink_begin"] = program.values["robolink_end"] = float(LAST_COUNT)
    machine.tools.select(1)
    program.call()
    assert program.values["robolink_begin"] == program.values["robolink_end"] == 1


# A program that calls back is answered although the record of its robot was lost.

PUT_NOTHING_BACK, SAYS_IT_KEPT = "1", "2"


class RefusingRecord:
    """A log that accepts no entry until a person has done something."""

    def __init__(self, error):
        self.error = error

    def ask(self, who):
        """Accept the robot's identity."""

    def open_markers(self):
        """Return no open markers."""
        return ()

    def append(self, *entries):
        """Refuse."""
        raise self.error


class RefusingJournal:
    """A journal with such a log only."""

    def __init__(self, error):
        self.error = error

    def log(self, controller, *, signature):
        """Return the log."""
        return RefusingRecord(self.error)


MISSING = OutcomeUnknownError("the record of before is missing", remedy="look")
DAMAGED = JournalError("the journal is damaged", remedy="move it away")


def hello(flag):
    value = ("12000", "-3500", "-20000", "0", "0", "0")
    return CallbackLine(1, CallbackWord.HELLO, ("SIM1", "1", flag, "none", "1", "1", *value))


def talk(error, tell):
    journal = cast(Journal, RefusingJournal(error))
    return CallbackConversation(journal, CallbackLimits(), peer="here", tell=tell)


@pytest.mark.parametrize(("error", "code"), [(MISSING, "unsettled"), (DAMAGED, "journal")])
def test_a_refusal_that_cannot_be_recorded_is_answered_and_a_person_is_told_why(error, code):
    told: list[tuple[str, RobolinkError]] = []
    conversation = talk(error, lambda *refusal: told.append(refusal))
    answer = conversation.answer(hello(PUT_NOTHING_BACK))
    assert (answer.word, answer.fields) == (CallbackWord.REFUSE, (code,))
    (first, _), second = told
    assert first == "not_restored"
    assert second == (code, error)


def test_a_journal_that_is_refused_for_its_damage_is_told_once():
    told: list[tuple[str, RobolinkError]] = []
    conversation = talk(DAMAGED, lambda *refusal: told.append(refusal))
    answer = conversation.answer(hello(SAYS_IT_KEPT))
    assert (answer.word, answer.fields) == (CallbackWord.REFUSE, ("journal",))
    assert told == [("journal", DAMAGED)]


def test_a_screen_that_is_gone_ends_no_conversation():
    def gone(_code, _error):
        raise BrokenPipeError

    assert talk(DAMAGED, gone).answer(hello(PUT_NOTHING_BACK)).word == CallbackWord.REFUSE
