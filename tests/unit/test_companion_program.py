"""robolink_tools.prg is legal SPEL+, and the simulated companion does what it says.

The simulator's grammar knows expressions, not programs. So the few forms of line that the
program has are taken apart here, every one must be of a known form, and each expression goes
through the simulator's own interpreter.
"""

import random
import re
from pathlib import Path

import pytest
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.companion import LAST_COUNT, Companion
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.variables import Variables
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel import Interpreter

from robolink.model import ToolOffset
from robolink.protocols.spel import parse_number

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
    """Runs the program on a machine, its expressions by the simulator's interpreter."""

    def __init__(self, machine):
        self.interpreter = Interpreter(machine, EpsonOptions(), random.Random(1))
        self.values = {}
        self.lines = [formed(line) for line in program_lines()]
        for form, parts in self.lines:
            if form in ("global", "local"):
                self.declare(parts[1])

    def declare(self, names):
        for name, bound in DECLARED.findall(names):
            self.values[name] = [0.0] * (int(bound) + 1) if bound else 0.0

    def call(self):
        form_at = [form for form, _ in self.lines]
        self.run(form_at.index("function") + 1, form_at.index("end"))

    def run(self, at, end):
        while at < end:
            form, parts = self.lines[at]
            if form == "for":
                close = self.close_of(at, "for", "next")
                for value in range(self.number(parts[1]), self.number(parts[2]) + 1):
                    self.values[parts[0]] = float(value)
                    self.run(at + 1, close)
                at = close
            elif form == "if":
                close = self.close_of(at, "if", "endif")
                other = self.else_of(at, close)
                if self.evaluate(parts[0]):
                    self.run(at + 1, other)
                else:
                    self.run(other + 1, close)
                at = close
            elif form == "assign":
                self.assign(*parts)
            else:
                assert form == "local"
            at += 1

    def close_of(self, at, opener, closer):
        depth = 0
        for place in range(at, len(self.lines)):
            depth += (self.lines[place][0] == opener) - (self.lines[place][0] == closer)
            if depth == 0:
                return place
        raise AssertionError(f"{opener} without {closer}")

    def else_of(self, at, close):
        depth = 0
        for place in range(at + 1, close):
            form = self.lines[place][0]
            depth += (form == "if") - (form == "endif")
            if form == "else" and depth == 0:
                return place
        return close

    def assign(self, name, index, expression):
        value = self.evaluate(expression)
        if index is None:
            assert isinstance(self.values[name], float)
            self.values[name] = value
        else:
            self.values[name][self.number(index)] = value

    def number(self, expression):
        return int(self.evaluate(expression))

    def evaluate(self, expression):
        """Put the variables' values in, then let the simulator evaluate the rest."""
        for name, value in self.values.items():
            if isinstance(value, list):
                for element, index in re.findall(rf"(\b{name}\(([^()]+)\))", expression):
                    shown = f"({value[self.number(index)]!r})"
                    expression = expression.replace(element, shown)
        for name, value in self.values.items():
            if not isinstance(value, list):
                expression = re.sub(rf"\b{name}\b(?!\()", f"({value!r})", expression)
        execution = self.interpreter.start(f"Print {expression}", 0)
        execution.advance(0)
        assert execution.error is None, (expression, execution.error)
        return parse_number(execution.output)

    def published(self):
        names = ("robolink_begin", "robolink_end", "robolink_state", "robolink_tool")
        return [self.values[name] for name in names]


@pytest.fixture
def machine():
    machine = Machine(find_robot("T6-602S"))
    machine.tools.set(1, ToolOffset(12.345, -3.5, -20.002, 90))
    machine.tools.set(15, ToolOffset(0.001, 0, 0, -179.5))
    machine.tools.select(15)
    return machine


def simulated(machine):
    """Return the same variables after the simulator's companion has run."""
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
