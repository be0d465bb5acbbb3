"""An injected defect is found, reported, shortened, and becomes a test."""

from collections.abc import Callable
from functools import cache

import pytest
from click.testing import CliRunner

from tests.soak.adversary import CellKind, live_through
from tests.soak.adversary.__main__ import main
from tests.soak.adversary.history import Deed, Disturbance, Habit, Hindrance, History, Hour
from tests.soak.adversary.history_run import as_test, shrink
from tests.soak.adversary.seed_records import ResultsFile

STOP = Disturbance(Hindrance.STOP, match="lock Move", at=2)
DROPPED = Disturbance(Hindrance.WIRE, "DROP_REPLY", "Move ", 3)
HISTORY = History(
    3,
    CellKind.EPSON,
    (
        Hour(0, Deed.SET_TOOL, Habit(), ()),
        Hour(1, Deed.CHANGE_NOZZLE, Habit(impatient=True), (DROPPED,)),
    ),
)
LONGER = History(
    3, CellKind.EPSON, (*HISTORY.hours, Hour(2, Deed.SELECT_TOOL, Habit(person="ben"), ()))
)
"""The history with another hour after the essential one, to be left out too."""

HISTORIES = pytest.mark.parametrize(
    "history", [HISTORY, pytest.param(LONGER, marks=pytest.mark.soak)], ids=["two hours", "three"]
)
FORGETFUL: dict[str, Callable[..., object]] = {
    "robolink.controllers.markers.MarkerStore._unsettled": lambda _store, _besides: []
}
"""A driver that moves although an earlier movement was not answered."""


@cache
def with_a_defect(history):
    return live_through(history, FORGETFUL)


@HISTORIES
def test_a_sound_driver_breaks_no_rule_in_it(history):
    story = live_through(history)
    assert story.broken == [], story.told()


@HISTORIES
def test_a_defect_is_found_told_and_cut_to_what_it_takes(history):
    (found, *_) = with_a_defect(history).broken
    assert found.rule == "NoMotionInDoubt"
    short = shrink(history, found.rule, run=with_a_defect)
    assert [hour.number for hour in short.hours] == [1]
    assert short.hours[0].disturbances == (DROPPED,)
    told = with_a_defect(short).told()
    assert "BROKEN  NoMotionInDoubt in hour 1" in told
    assert "in the way: wire DROP_REPLY at number 3 of 'Move '" in told
    assert '$Execute,"Move XY(' in told


def test_it_becomes_a_test_that_runs(tmp_path):
    path = tmp_path / "test_found.py"
    path.write_text(as_test(HISTORY, "NoMotionInDoubt"))
    namespace: dict[str, object] = {}
    exec(compile(path.read_text(), str(path), "exec"), namespace)
    assert namespace["HISTORY"] == HISTORY


def test_a_stop_is_placed_where_it_is_to_be():
    stopped = History(3, CellKind.EPSON, (Hour(0, Deed.CHANGE_NOZZLE, Habit(), (STOP,)),))
    story = live_through(stopped)
    assert story.broken == []
    assert story.met[Hindrance.STOP] == 1
    assert story.endings == {"change the nozzle: StoppedError": 1}
    assert any("stop: acknowledged" in line for line in story.lines())


def test_a_range_is_gone_on_with_and_summed_up(tmp_path):
    results = tmp_path / "results.jsonl"
    command = ["--hours", "1", "--results", str(results)]
    first = CliRunner().invoke(main, ["--seeds", "2-2", *command])
    assert first.exit_code == 0, first.output
    with results.open("a") as file:
        file.write('{"seed": 3, "ki')  # killed while it wrote
    results.write_text(results.read_text() + "\n")
    again = CliRunner().invoke(main, ["--seeds", "2-3", *command])
    assert "seed 2" not in again.output
    assert "seed 3" in again.output
    assert [one.seed for one in ResultsFile(results).results()] == [2, 3]
    assert "2 virtual hours, 2 seeds" in CliRunner().invoke(main, command).output


@pytest.mark.parametrize("given", ["x", "3-", "-2"])
def test_a_range_that_is_none_is_refused(given):
    assert CliRunner().invoke(main, ["--seeds", given]).exit_code == 2
