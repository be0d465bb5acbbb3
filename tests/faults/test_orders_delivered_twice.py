"""One order delivered twice, whatever became of the first delivery: row F79.

A program is killed at an exchange, or at a durable transaction of the journal, and its order is
delivered again; so is that of a whole ``robolink change``. By default a few of those instants are
taken, under the marker ``soak`` all.
"""

import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from itertools import count
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple

import pytest

import robolink
from robolink.errors import BusyError, ConfigError, LeaseLostError, OutcomeUnknownError
from robolink.journal import memory_journal, open_journal
from robolink.model import ANY, EntryKind, Marker, MarkerKind, plain_offset
from robolink.testing import MemoryController, MemoryMachine
from robolink.transaction import Settler, ToolChange, Wanted, carrying_out, change_tools
from tests._patience import PATIENCE_S
from tests.faults._change_cell import ChangeCell, Step, change_cell
from tests.faults._change_process import NEW, OLD, ORDER, PROGRAMS, CommitStep
from tests.faults._client_process import ClientProcess
from tests.faults._deaths import Deaths
from tests.faults._epson_recipe_cell import EpsonRecipeCell
from tests.faults._nozzle_cell import OLD_TIP, NozzleCell, served_cell
from tests.faults._softmotion_change_cell import plc_change_cell
from tests.faults._steps import MOMENTS, Moment

pytestmark = pytest.mark.timeout(3600)

CELLS: dict[str, Callable[[Path], AbstractContextManager[ChangeCell]]] = {
    "EPSON": change_cell,
    "PLC": plc_change_cell,
}
SOAK = pytest.mark.soak
KILL_SHARES = 16
"""Into so many tests the instants of a whole change are dealt; each takes about 14 s of CPU."""

RECIPE = """
schema = "robolink/recipe/1"
name = "touch"
basis = "absolute"
z = "kept"
[source]
kind = "two-pose"
[station]
id = "PIN"
[[tools]]
number = 1
"""


def deliver(cell: ChangeCell, program: str) -> None:
    log = cell.journal.log(cell.url)
    with robolink.connect(cell.url, outcomes=log) as controller:
        PROGRAMS[program](controller)


def check_killed_order(cell: ChangeCell, program: str, step: Step) -> None:
    """Kill an order at a step and deliver it until it is carried out, and then once more."""
    tools = [1, 2] if program.startswith("two") else [1]
    cell.kill(program, step)
    if cell.journal.open_markers():
        written = cell.writes()
        with pytest.raises(OutcomeUnknownError, match="recover"):
            deliver(cell, program)
        assert cell.writes() == written
        cell.recover()
    stands = all(cell.tools[tool] == NEW[tool] for tool in tools)
    assert len(list(cell.journal.entries(kinds=(EntryKind.ORDER,)))) == stands
    deliver(cell, program)
    assert cell.tools == {tool: NEW[tool] if tool in tools else OLD[tool] for tool in OLD}
    for tool in tools:
        # Each time that it was made, but the last, it had been taken back.
        made = cell.values_written(tool)
        assert made[0::2] == [NEW[tool]] * len(made[0::2])
        assert made[1::2] == [OLD[tool]] * len(made[1::2])
        assert len(made) in ((1,) if len(tools) == 1 else (1, 3))
    written = cell.writes()
    deliver(cell, program)
    assert cell.writes() == written
    kept = list(cell.journal.entries(kinds=(EntryKind.ORDER,)))
    assert [entry.details["order"] for entry in kept] == [ORDER]
    cell.check_all_is_settled()


def sample(steps: list[Step]) -> list[Step]:
    """Return the transaction that keeps the value, just before and just after it counts."""
    commits: list[Step] = [step for step in steps if isinstance(step, CommitStep)]
    return commits[-4:-2]  # the last one gives the lease up


@pytest.mark.parametrize(
    ("kind", "program", "whole"),
    [
        ("EPSON", "one tool, ordered", False),
        ("PLC", "one tool, ordered", False),
        *(
            pytest.param(kind, program, True, marks=SOAK)
            for kind in CELLS
            for program in ("one tool, ordered", "two tools, ordered")
        ),
    ],
)
@pytest.mark.fault("F79")
def test_f79_an_order_killed_at_each_step_and_delivered_again_is_carried_out_once(
    tmp_path, kind, program, whole
):
    with CELLS[kind](tmp_path / "whole") as cell:
        steps = cell.steps_of(program)
    chosen = steps if whole else sample(steps)
    for number, step in enumerate(chosen):
        with CELLS[kind](tmp_path / str(number)) as cell:
            try:
                check_killed_order(cell, program, step)
            except AssertionError as error:
                error.add_note(f"killed at {step}")
                raise
    print(f"{kind}, {program}: {len(chosen)} kill points of {len(steps)}")  # noqa: T201 - for pytest -s


class Instant(NamedTuple):
    """An exchange of a change, by how often such a one came before: how long it polls varies."""

    request: str
    nth: int
    moment: Moment


def kind_of(request: str) -> str:
    return request.partition("XY(")[0]


def kill_change(cell: NozzleCell, at: Instant) -> None:
    """Start an ordered change and kill its process at an instant, if it comes to it."""
    started: SimpleQueue[ClientProcess] = SimpleQueue()
    seen: list[int] = []

    def hold(number: int, text: str) -> None:
        if kind_of(text) == at.request:
            seen.append(number)
            if len(seen) == at.nth and at.moment == MOMENTS[0]:
                started.get(timeout=PATIENCE_S).kill()

    def hold_answer(number: int, _text: str) -> None:
        if seen[at.nth - 1 : at.nth] == [number] and at.moment == MOMENTS[1]:
            started.get(timeout=PATIENCE_S).kill()

    with cell.simulator.lock:
        cell.simulator.on_request, cell.simulator.on_reply = hold, hold_answer
    client = cell.calibrate()
    started.put(client)
    assert client.exit_code() in (0, -9)
    with cell.simulator.lock:
        cell.simulator.on_request = cell.simulator.on_reply = None


def ordered_change(cell: NozzleCell) -> list[str]:
    recipe = cell.folder / "touch.toml"
    recipe.write_text(RECIPE)
    assist = ["--assist", cell.assist_url]
    return ["change", str(recipe), "--order", ORDER, "--yes", *assist]


def check_killed_change(cell: NozzleCell, at: Instant) -> None:
    machine = cell.simulator.machine
    kill_change(cell, at)
    cell.wait_at_rest()
    if cell.open_markers():
        moves, writes = machine.arm.moves_started, machine.flash_writes
        assert cell.run(*ordered_change(cell)).code == 6
        assert (machine.arm.moves_started, machine.flash_writes) == (moves, writes)
        assert cell.run("recover", "--yes").code == 0
    machine.motors_on = True
    first = cell.run(*ordered_change(cell), "--json")
    assert first.code == 0, first.err
    assert cell.tool_1 != OLD_TIP
    made, moves, writes = cell.tool_1, machine.arm.moves_started, machine.flash_writes
    again = cell.run(*ordered_change(cell), "--json")
    assert again.code == 0, again.err
    assert (cell.tool_1, machine.arm.moves_started, machine.flash_writes) == (made, moves, writes)
    told = json.loads(again.out)
    assert (told["order"], told["already_done"]) == (ORDER, True)
    assert told == {**json.loads(first.out), "already_done": True}
    kept = list(open_journal().entries(kinds=(EntryKind.ORDER,)))
    assert [entry.change for entry in kept] == [told["change"]]
    cell.check_settings_are_those_of_before()


def check_killed_at(folder: Path, monkeypatch: pytest.MonkeyPatch, at: Instant) -> None:
    monkeypatch.setattr(NozzleCell, "calibration", property(ordered_change))
    with served_cell(folder, monkeypatch) as cell:
        try:
            check_killed_change(cell, at)
        except AssertionError as error:
            error.add_note(f"killed at {at}")
            raise


@pytest.mark.fault("F79")
def test_f79_a_change_killed_at_its_write_and_delivered_again_is_made_once(tmp_path, monkeypatch):
    write = Instant('$Execute,"TLSet 1, ', 1, MOMENTS[0])
    check_killed_at(tmp_path / "cell", monkeypatch, write)


def words_of_the_order(cell: EpsonRecipeCell, folder: Path) -> list[str]:
    recipe = folder / "touch.toml"
    recipe.write_text(RECIPE)
    return ["change", str(recipe), "--order", ORDER, "--yes", "--json", "--assist", cell.url]


def check_delivered_again(cell: EpsonRecipeCell, words: list[str]) -> None:
    """The order of a change that was killed is carried out once, however often it is delivered."""
    cell.come_to_rest()
    if cell.open_markers():
        moves, writes = cell.moves_begun, cell.writes()
        assert cell.run(*words).code == 6
        assert (cell.moves_begun, cell.writes()) == (moves, writes)
        assert cell.run("recover", "--yes").code == 0
    cell.simulator.machine.motors_on = True
    first = cell.run(*words)
    assert first.code == 0, first.err
    assert cell.changed() == {1}
    made, moves, writes = cell.tools(), cell.moves_begun, cell.writes()
    again = cell.run(*words)
    assert again.code == 0, again.err
    assert (cell.tools(), cell.moves_begun, cell.writes()) == (made, moves, writes)
    told = json.loads(again.out)
    assert (told["order"], told["already_done"]) == (ORDER, True)
    assert told == {**json.loads(first.out), "already_done": True}
    kept = list(cell.journal.entries(kinds=(EntryKind.ORDER,)))
    assert [entry.change for entry in kept] == [told["change"]]
    assert (cell.selected, cell.settings()) == (1, cell.settings_before)


@pytest.mark.parametrize("share", [pytest.param(share, marks=SOAK) for share in range(KILL_SHARES)])
@pytest.mark.fault("F79")
def test_f79_a_change_killed_at_each_step_and_delivered_again_is_made_once(tmp_path, share):
    cell = EpsonRecipeCell((1,))
    words = words_of_the_order(cell, tmp_path)
    deaths = Deaths(
        lambda instant: instant % KILL_SHARES == share,
        lambda: check_delivered_again(cell, words),
    )
    with deaths.deadly():
        ended = cell.run(*words, instants=deaths)
    cell.close()
    assert ended.code == 0, ended.err
    assert deaths.told == []
    print(f"{len(range(share, deaths.chances, KILL_SHARES))} kill points of {deaths.chances}")  # noqa: T201 - for pytest -s


_desks = count()


class Desk:
    """Several programs on one machine with one record."""

    def __init__(self) -> None:
        self.machine = MemoryMachine()
        self.journal = memory_journal(f"desk-{next(_desks)}")

    def connected(self) -> MemoryController:
        log = self.journal.log("memory://desk")
        return MemoryController(self.machine, identity="memory://desk", outcomes=log)


JOB = {"what": "tool 1"}


@pytest.mark.fault("F79")
def test_f79_of_two_at_once_one_is_let_in_and_the_other_then_sees_its_result():
    desk = Desk()
    with desk.connected() as one, desk.connected() as two:
        with carrying_out(one, ORDER, JOB) as order:
            with pytest.raises(BusyError), carrying_out(two, ORDER, JOB):
                pytest.fail("both were let in")
            change_tools(one, [Wanted(1, NEW[1], ANY)], order=order)
        with carrying_out(two, ORDER, JOB) as order:
            assert order.done is not None
            value = plain_offset(NEW[1])
            made = {"tool": 1, "before": None, "requested": value, "read_back": value}
            assert order.done.result == {"tools": [made]}
    for entry in desk.journal.entries(kinds=(EntryKind.INTENT, EntryKind.WRITE, EntryKind.DONE)):
        assert entry.details["order"] == ORDER


@pytest.mark.fault("F79")
def test_f79_an_order_whose_change_was_not_kept_may_be_run_again():
    desk = Desk()
    with desk.connected() as controller:
        before = controller.tools.read(1)
        with carrying_out(controller, ORDER, JOB) as order:
            change = ToolChange(
                controller, [Wanted(1, NEW[1], ANY)], order=order, describe=lambda _made: {}
            )
            with pytest.raises(ConfigError, match="no"), change:
                change.write()
                raise ConfigError("no")
        assert controller.tools.read(1) == before
        with carrying_out(controller, ORDER, JOB) as order:
            assert order.done is None


@pytest.mark.fault("F79")
def test_f79_a_value_that_stood_already_makes_an_order_done_all_the_same():
    desk = Desk()
    with desk.connected() as controller:
        change_tools(controller, [Wanted(1, NEW[1], ANY)])
        with carrying_out(controller, ORDER, JOB) as order:
            (receipt,) = change_tools(controller, [Wanted(1, NEW[1], NEW[1])], order=order)
            assert receipt.skipped
        with carrying_out(controller, ORDER, JOB) as order:
            assert order.done is not None


@pytest.mark.fault("F79")
def test_f79_an_order_is_not_told_as_done_while_something_is_not_put_back():
    """Production that is started on it would run with the tool in force of the measurement."""
    desk = Desk()
    with desk.connected() as controller:
        with carrying_out(controller, ORDER, JOB) as order:
            change_tools(controller, [Wanted(1, NEW[1], ANY)], order=order)
        # As a process leaves it that is killed behind the transaction that keeps the value.
        left = Marker("killed", MarkerKind.SELECTION, "calibrate tool 1", "then", {"tool": 1})
        controller.outcomes.begin(left)
        with (
            pytest.raises(OutcomeUnknownError, match="calibrate tool 1"),
            carrying_out(controller, ORDER, JOB),
        ):
            pytest.fail("it was told as done")
        controller.finish(left)
        with carrying_out(controller, ORDER, JOB) as order:
            assert order.done is not None


@pytest.mark.fault("F79")
def test_f79_a_first_order_begins_nothing_while_something_is_unsettled():
    """Its job may move before anything is written, and would find out at its end only."""
    desk = Desk()
    with desk.connected() as controller:
        left = Marker("killed", MarkerKind.SELECTION, "calibrate tool 1", "then", {"tool": 1})
        controller.outcomes.begin(left)
        with (
            pytest.raises(OutcomeUnknownError, match="calibrate tool 1"),
            carrying_out(controller, ORDER, JOB),
        ):
            pytest.fail("it was begun")


@pytest.mark.fault("F79")
def test_f79_an_order_that_was_closed_without_looking_is_not_run_again():
    desk = Desk()
    with desk.connected() as controller:
        with carrying_out(controller, ORDER, JOB) as order:
            change = ToolChange(controller, [Wanted(1, NEW[1], ANY)], order=order)
            with pytest.raises(LeaseLostError), change:
                change.write()
                raise LeaseLostError("as if it had been killed here")
        (marker,) = controller.outcomes.open_markers()
        Settler(controller).forget(marker)
        with (
            pytest.raises(ConfigError, match="closed without a look"),
            carrying_out(controller, ORDER, JOB),
        ):
            pytest.fail("it was run again")
