"""docs/spel-programs.md says what is so: each of its rows is sent, and the answer compared."""

import re
from pathlib import Path

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.spel.expressions.functions import PLAIN_FUNCTIONS
from robolink_simulators.epson.spel.expressions.machine_functions import (
    MACHINE_FUNCTIONS,
    OF_POINT_NUMBERS,
    POINT_FUNCTIONS,
)
from robolink_simulators.epson.spel.expressions.state_functions import STATE_FUNCTIONS
from robolink_simulators.epson.spel.parser import (
    UNSIMULATED,
    UNSIMULATED_FAMILIES,
    UNSIMULATED_FUNCTIONS,
    WINDOW_ONLY,
)
from robolink_simulators.epson.spel.programs.text_statements import FUNCTIONS_OF_ARRAYS
from robolink_simulators.epson.spel.tasks.task_functions import TASK_FUNCTIONS

PAGE = Path(__file__).parents[2] / "docs" / "spel-programs.md"
_ROW = re.compile(r"^\| `(?P<statement>[^|]+)` \| (?P<who>[^|]+) \| (?P<answer>[^|]+) \|$")
_LONGEST_S = 120


def part():
    page = PAGE.read_text(encoding="utf-8")
    return page.partition("\n## Statements that the simulator answers\n")[2]


def rows():
    answered = part().partition("### Not carried out")[0]
    found = map(_ROW.match, answered.splitlines())
    return [(row["statement"], row["answer"]) for row in found if row]


def before():
    (block,) = re.findall(r"```\n(.*?)```", part(), re.DOTALL)
    return block.strip().splitlines()


def answer(client, statement):
    """Send a statement and wait for its end; return what was printed, 0, or the error number."""
    said = client.ask(f'$Execute,"{statement}"')
    waited = 0
    while not said and waited < _LONGEST_S:
        said = client.wait(1.0)
        waited += 1
    if said == "#Execute,0":
        return "0"
    if said == "!Execute,99":
        return str(client.code())
    assert said.startswith('#Execute,"'), said
    return "`" + said.removeprefix('#Execute,"').removesuffix('"').removesuffix("\r\n") + "`"


@pytest.fixture
def client(login):
    client = login(EpsonSimulator(serial="SIM00001", options=EpsonOptions(remote_timeout_s=0)))
    for line in before():
        assert answer(client, line) == "0"
    return client


@pytest.mark.parametrize(("statement", "expected"), rows(), ids=lambda value: value[:40])
def test_a_statement_is_answered_as_the_page_says(client, statement, expected):
    said = answer(client, statement)
    pattern = re.escape(expected).replace(re.escape("..."), ".*")
    assert re.fullmatch(pattern, said, re.DOTALL), said


def test_the_page_has_all_its_rows():
    assert len(rows()) > 120


def test_if_runs_where_the_option_says_so(login):
    client = login(EpsonSimulator(options=EpsonOptions(single_line_if="runs")))
    assert answer(client, "If Error On Then Reset") == "0"
    assert answer(client, "If Sw(1)=Off Then Print 1; Print 2 Else Print 3") == "`1\r\n2`"
    assert answer(client, "If Sw(1)=On Then Print 1 Else Print 3") == "`3`"


def test_an_assigned_variable_is_read_over_the_wire_and_back(login):
    client = login(EpsonSimulator())
    assert answer(client, "g_Long = 2 * 3") == "0"
    assert client.ask("$GetVariable,g_Long,Long") == "#GetVariable,6"
    assert answer(client, "Print g_Long + 1") == "`7`"
    refusing = login(EpsonSimulator(options=EpsonOptions(variable_assignment="refused")))
    assert answer(refusing, "g_Long = 1") == "2353"


def refused_words():
    """Return the statements and the functions that a program may hold and that are refused."""
    known = {"pdef", *PLAIN_FUNCTIONS, *MACHINE_FUNCTIONS, *POINT_FUNCTIONS, *STATE_FUNCTIONS}
    known |= {*TASK_FUNCTIONS, *FUNCTIONS_OF_ARRAYS, *OF_POINT_NUMBERS}
    return UNSIMULATED - WINDOW_ONLY, UNSIMULATED_FUNCTIONS - known


def test_what_is_refused_is_listed_by_name():
    section = PAGE.read_text(encoding="utf-8").partition("## Not carried out")[2]
    _, statements, functions = re.split(r"^Statements:$|^Functions:$", section, flags=re.MULTILINE)
    functions, families = functions.split("begin so")
    listed = [set(re.findall(r"`([^`]+)`", part)) for part in (statements, functions, families)]
    families = {f"{word}..." for word in UNSIMULATED_FAMILIES}
    assert listed == [*refused_words(), families]
