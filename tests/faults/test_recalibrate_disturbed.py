"""`robolink change RECIPE.toml`, disturbed at each instant of its run (F21, F22, F24).

Ctrl-C ends a run with the old values in all tools, or with the new ones once all are tested, and
with the selected tool, power and speed as before. After an emergency stop, an opened guard, a
failed drive or a withdrawn permit not everything can be restored: message and marker name the rest,
and after the reset one more command recovers it. Outputs stay as the recipe switched them, and the
end of the run names them.

By default a sample is used. ``ROBOLINK_ALL_KILL_POINTS=1`` uses all instants, on a PLC without the
inner ones of rows of polls. ``pytest -s`` shows how many.
"""

import re
from typing import Final

import pytest

from tests._commands import Ended
from tests.faults._recipe_cases import CASES
from tests.faults._recipe_ends import (
    Disturbance,
    check_interrupted,
    check_put_right,
    check_stopped,
)
from tests.faults._recipe_instants import (
    EVERYTHING,
    Instant,
    Instants,
    chosen,
    noted,
    without_inner_polls,
)

pytestmark = pytest.mark.timeout(7200)

CTRL_C: Final = "Ctrl-C"
TESTS: Final = [
    (name, how) for name, case in CASES.items() for how in (CTRL_C, *case.kind.disturbances)
]
EACH_TIME: Final[dict[str, tuple[str, ...]]] = {
    "EPSON, two tools": (CTRL_C, "e-stop", "guard"),
    "PLC, one tool": (CTRL_C, "e-stop", "drive fault", "permit"),
}
"""Each disturbance on each kind; the same of the other number of tools runs only in soak."""
ROWS: Final = [
    pytest.param(
        name,
        how,
        marks=() if EVERYTHING or how in EACH_TIME.get(name, ()) else pytest.mark.soak,
    )
    for name, how in TESTS
]
MATTERS: Final = re.compile(
    r'\$(SetIO|Execute,"(Tool \d|TLSet \d))|write_command (SELECT|WRITE|OWNER)|[A-Z]'
)
"""Instants that switch, select, write, take or release; and questions."""
POLLS: Final = re.compile("wait|(request|answer) (read_head|beat)")
"""The repeated acts of a PLC driver during a movement."""

OPCUA_POLLS: Final = re.compile(f"{POLLS.pattern}|(request|answer) read_response")
"""The same over OPC UA, where a look at the head reads the whole response."""

SHOWS_LATER: Final = re.compile(r"commit|answer \d+: (read|beat)")
"""A disturbance while the driver stores something, or just after a PLC was read, shows with the
next exchange, which is an instant of its own.
"""


@pytest.fixture(scope="module")
def instants(tmp_path_factory):
    """Returns the instants of a whole run of each recipe, which is checked first."""
    known: dict[str, list[Instant]] = {}

    def of(name: str) -> list[Instant]:
        if name not in known:
            case, passed = CASES[name], Instants()
            with case.cell() as cell:
                ended = case.run(cell, tmp_path_factory.mktemp("whole"), passed)
                assert ended.code == 0, ended.err
                assert cell.changed() == set(case.tools)
                assert (cell.selected, cell.settings()) == (1, cell.settings_before)
                assert cell.outputs() == cell.outputs_before
            known[name] = passed.passed
        return known[name]

    return of


def check(disturbance: Disturbance, ended: Ended, at: Instant) -> None:
    cell = disturbance.cell
    assert disturbance.came, "the instant was not reached"
    if disturbance.how == CTRL_C:
        check_interrupted(cell, ended, disturbance)
    else:
        check_stopped(cell, ended, disturbance)
        check_put_right(cell, disturbance, offered=bool(at.number % 2))


def steps_of(name: str, how: str, whole: list[Instant]) -> list[Instant]:
    """Return the instants of a whole run at which one disturbance occurs."""
    if name.startswith("PLC"):
        whole = without_inner_polls(whole, OPCUA_POLLS if "OPC UA" in name else POLLS)
    if how != CTRL_C:
        whole = [instant for instant in whole if not SHOWS_LATER.match(str(instant))]
    steps = chosen(whole, MATTERS, turn=TESTS.index((name, how)))
    print(f"{name}, {how}: {len(steps)} instants of {len(whole)}")  # noqa: T201 - for pytest -s
    return steps


@pytest.mark.fault("F21", "F22", "F24")
@pytest.mark.parametrize(("name", "how"), ROWS)
def test_f21_f22_f24_a_disturbed_run_leaves_all_or_nothing_and_says_what(
    tmp_path, instants, name, how
):
    case = CASES[name]
    for at in steps_of(name, how, instants(name)):
        with case.cell() as cell, noted(at):
            disturbance = Disturbance(cell, how)
            ended = case.run(cell, tmp_path, Instants(at, disturbance))
            check(disturbance, ended, at)
