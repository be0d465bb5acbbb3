"""Published figures: each from its case, and none from a busy machine."""

import importlib
import json
import os
import sys
from collections import Counter
from xml.etree import ElementTree

import pytest

from benchmarks import __main__ as bench
from benchmarks import page
from benchmarks.cases import CASES, measured_alone
from benchmarks.pictures import Growth, picture
from benchmarks.quiet import SPREAD, Floors
from benchmarks.table import Amount, Figure
from benchmarks.work.asked_cells import WRITE_S, lived, lived_apart
from benchmarks.work.nozzle_change import measured_needle
from benchmarks.work.virtual_time import of_fleets
from robolink.journal import memory_journal
from robolink.model import EntryKind

SLOW = Figure("a stop", Amount(30.0, "ms"), "a floor", Amount(10.0, "ms"), 3.0, 2.5)
QUICK = Figure("a look", Amount(1.234, "us"), "a floor", Amount(1.0, "us"), 1.234, 1.3)
GROWTH = Growth("growth-test", "A < B", "poses", "us", ((10, 3.0), (1_000, 250.0)))
ABOUT = {
    "schema": bench.SCHEMA,
    "date": "1 January 2026",
    "machine": "a machine",
    "load": "9.00",
    "versions": {"Python": "3.11"},
    "noise": "the same work took 1 to 3 us, 3.00 times its fastest",
}


def test_each_case_is_there_and_has_its_title_on_the_page():
    written = page.PAGE.read_text(encoding="utf-8")
    assert list(page.TITLES) == list(CASES)
    for name, where in CASES.items():
        source = (page.ROOT / "benchmarks" / f"{where.replace('.', '/')}.py").read_text()
        assert f"def measure_{where.rpartition('.')[2]}(" in source
        assert f"\n## {page.TITLES[name]}\n" in written


def test_cells_in_virtual_time_are_asked_each_second_and_written_to_each_minute():
    (factor,) = lived(3, WRITE_S, 1)
    assert factor > 0
    written = list(memory_journal("bench-asked-3").entries(kinds=[EntryKind.DONE]))
    assert sorted(Counter(entry.controller for entry in written).values()) == [2, 2, 2]


def test_a_fleet_is_divided_among_processes_and_is_as_fast_as_the_slowest():
    factors = lived_apart(3, 2, 4, processes=2)
    assert len(factors) == 4
    assert all(factor > 0 for factor in factors)


def test_a_needle_on_its_beams_is_as_fast_as_is_wanted_on_any_machine():
    motion, slow, requests = measured_needle()
    wanted = [(one.against, str(one.floor), one.goal) for one in (motion, slow, requests)]
    assert wanted == [("wanted", most, 1.0) for most in ("10.0 s", "20.0 s", "450 ")]
    assert (motion.met, slow.met, requests.met) == (True, True, True)
    # Each of some 230 answers takes 20 ms; what is said while the robot moves costs nothing.
    assert motion.ours.value + 3.0 < slow.ours.value < motion.ours.value + 5.0


@pytest.mark.parametrize("each_s", [0.0349, 0.035, 0.07])
def test_what_is_wanted_of_a_fleet_follows_from_one_recalibration(each_s):
    one, hundred, thousands = of_fleets(14.0, each_s)
    assert one.ours.value == pytest.approx(each_s * 1000)
    assert str(one.floor) == "35.0 ms"
    for fleet, cells in ((hundred, 100), (thousands, 2000)):
        assert fleet.ours.value == pytest.approx(14.0 / (cells * each_s))
        assert fleet.floor is not None
        assert fleet.floor.value == pytest.approx(14.0 / (cells * 0.035))
        assert fleet.ratio == pytest.approx(one.ratio)
        assert fleet.goal == one.goal
        assert fleet.name.startswith(f"{cells} cells ")


def test_a_case_is_measured_in_a_process_of_its_own():
    case = "benchmarks.work.kinematics"
    before = case in sys.modules
    (figure,) = measured_alone("kinematics")
    assert figure.ours.value > 0
    assert (case in sys.modules) == before


def test_a_ratio_over_its_goal_is_missed_and_without_a_goal_neither():
    assert (SLOW.met, QUICK.met, Figure("x", Amount(1, "s")).met) == (False, True, None)
    assert SLOW.cells()[3:] == ("30.0 ms", "3.00", "<= 2.50", "missed")
    assert json.loads(json.dumps(QUICK.document()))["ours"] == {"value": 1.234, "unit": "us"}


def test_a_machine_that_was_slow_once_is_not_quiet():
    floors = Floors([100.0, 110.0], best_us=95.0)
    assert floors.quiet
    floors.taken_us.append(95.0 * SPREAD * 1.05)
    assert not floors.quiet


def test_the_processes_that_are_measured_keep_their_bytecode(monkeypatch):
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    importlib.reload(bench)
    assert "PYTHONDONTWRITEBYTECODE" not in os.environ


@pytest.mark.parametrize("quiet", [True, False])
def test_the_page_says_what_was_missed_and_whether_the_machine_was_busy(
    tmp_path, monkeypatch, quiet
):
    monkeypatch.setattr(page, "PAGE", tmp_path / "performance.md")
    monkeypatch.setattr(page, "PICTURES", tmp_path)
    page.publish({**ABOUT, "quiet": quiet}, {"stopping": [SLOW, QUICK]}, [GROWTH])
    written = (tmp_path / "performance.md").read_text()
    assert "Goals met: 1 of 2." in written
    assert "* missed: a stop (3.00, goal 2.50)." in written
    assert ("busy with other work" in written) is not quiet
    assert "| a look | a floor | 1.00 us | 1.23 us | 1.23 | <= 1.30 | met |" in written
    assert (tmp_path / "growth-test.svg").exists()


def test_a_picture_is_well_formed_and_shows_every_point():
    drawn = ElementTree.fromstring(picture(GROWTH))
    circles = [float(at.attrib["cy"]) for at in drawn.iter("{http://www.w3.org/2000/svg}circle")]
    assert len(circles) == 2
    assert circles[0] > circles[1]


@pytest.mark.parametrize("asked", [["nothing"], ["fleet", "--publish"]])
def test_what_is_no_case_and_a_part_of_a_run_are_refused(monkeypatch, capsys, asked):
    monkeypatch.setattr(sys, "argv", ["benchmarks", *asked])
    with pytest.raises(SystemExit) as ended:
        bench.main()
    assert ended.value.code == 2
    assert ("no case" if asked == ["nothing"] else "whole run") in capsys.readouterr().err


def test_a_busy_machine_publishes_nothing_and_says_so(capsys):
    assert bench.refuse_to_publish() == bench.TOO_NOISY
    assert "Not published" in capsys.readouterr().err
