"""The page about a plant says what is on record of it, from copies and from journals alike."""

import dataclasses
import json
import random
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta

import pytest
from robolink_cli import main

from robolink.config import add_cell
from robolink.fleet import (
    CellState,
    FleetStore,
    JobState,
    PlanSummary,
    PlantLook,
    PlantNotes,
    RecipeInUse,
    default_plant,
    report_of,
)
from robolink.fleet.plant_view.copies import CopiedJournal, copied_journals, own_journals
from robolink.fleet.plant_view.report_page import MOST_ROWS, render_plant, some_names
from robolink.journal import open_journal
from robolink.journal._outbox import home_of
from robolink.locale.languages import speak
from robolink.model import EntryKind, NewEntry, Recorded, Signature
from tests.fleet._plans import permitted, plan_with

NOW = datetime(2026, 11, 30, 12, 0, tzinfo=UTC)


def ago(**by):
    return (NOW - timedelta(**by)).isoformat(timespec="seconds")


def entries(controller, *, count=30, wear_mm=0.0, recipe="needle", last_mm=0.0):
    """The entries of a cell whose tip scatters, wears, and at last is somewhere else."""
    made, before = list[Recorded](), None
    chance = random.Random(controller)
    about = Signature(nozzle="N-1", recipe=recipe, recipe_hash=recipe * 4)
    for k in range(count):
        at = ago(days=count - 1 - k, hours=1)
        off = chance.gauss(0, 0.01) + (last_mm if k == count - 1 else 0.0)
        tip = [round(12 + off, 3), -3.5, round(-20 + wear_mm * k, 3), 0.0, 0.0, 0.0]
        measured = {"tip": tip, "measured": ["x_mm", "y_mm", "z_mm"], "method": "two-pose"}
        for kind, details in (
            (EntryKind.CALIBRATION, measured),
            (EntryKind.DONE, {"before": before, "value": tip}),
        ):
            number = len(made) + 1
            said = (number, at, controller, kind, f"c-{k}", "", 1, "", "", details, about, "", "")
            made.append(Recorded(*said))
        before = tip
    return made


def journal_of(cell, found: Iterable[Recorded], *, copied_at=""):
    return CopiedJournal(f"PC:{cell}.db", copied_at, iter(list(found)))


def state_of(cell, **more):
    usual = {
        "noted_at": ago(minutes=5),
        "checked_at": ago(hours=8),
        "well": True,
        "recipe": RecipeInUse("needle", "needle" * 4, ago(days=29)),
    }
    return CellState(f"epson:{cell}", f"PC:{cell}.db", **{**usual, **more})


def made(states, journals, *, unnoted=(), plans=(), **more):
    about = {"plant": "plant", "since": ago(days=60)[:10], "now": NOW, "check_days": 7.0}
    look = PlantLook(states, plans, unnoted=unnoted)
    return report_of(look, journals, **{**about, **more})


def test_a_plant_in_order_says_so():
    report = made({"a": state_of("a")}, [journal_of("a", entries("epson:a"))])
    assert report.in_order
    assert (report.cell_count, report.change_count) == (1, 30)
    assert "Nothing needs a person" in render_plant(report)


def test_what_needs_a_person_is_named():
    states = {
        "begun": state_of("begun", unsettled_since=ago(hours=3)),
        "found": state_of("found", well=False, verdict="Needs attention: tool_changed."),
        "late": state_of("late", checked_at=ago(days=9)),
        "never": state_of("never", checked_at="", well=None),
        "silent": state_of("silent", noted_at=ago(days=3)),
        "behind": state_of("behind", changed_at=ago(hours=1)),
        "well": state_of("well", changed_at=ago(days=3)),
    }
    journals = [journal_of(cell, [], copied_at=ago(days=2)) for cell in ("behind", "well")]
    report = made(states, journals)
    assert not report.in_order
    assert list(report.unsettled) == ["begun"]
    assert report.attention == {"found": "Needs attention: tool_changed."}
    assert report.overdue == {"late": 9.0, "never": None}
    assert report.unheard == {"silent": 3.0}
    assert report.behind == {"behind": 2.0}
    page = render_plant(report)
    for cell in states.keys() - {"well"}:
        assert cell in page, cell
    assert "<script" not in page
    assert "http" not in page.replace("http-equiv", "")


def test_a_cell_that_was_never_copied_or_never_noted_needs_a_person():
    states = {"new": state_of("new", changed_at=ago(hours=1)), "unchanged": state_of("unchanged")}
    copies = [journal_of("other", [], copied_at=ago(hours=1))]
    for journals in (copies, []):
        report = made(states, journals)
        assert report.behind == {"new": None}
        assert not report.in_order
    assert "new (never)" in render_plant(report)
    own = [journal_of("other", [])]  # this computer's journals are no copies
    assert made(states, own).in_order
    report = made({}, [], unnoted=("silent",))
    assert (report.unheard, report.in_order) == ({"silent": None}, False)
    assert "silent (never)" in render_plant(report)


@pytest.mark.parametrize(
    ("state", "fine"),
    [
        *((one, True) for one in ("kept", "unproved", "waiting", "running", "cancelled")),
        *((one, False) for one in ("refused", "unsettled", "missed")),
    ],
)
def test_a_job_that_did_not_do_what_was_asked_needs_a_person(state, fine):
    counts = {JobState.KEPT: 3, JobState(state): 2}
    plan = PlanSummary("1" * 12, "check", "nightly", ago(days=2), "", "", counts)
    report = made({}, [], plans=(plan,))
    assert report.in_order is fine
    assert ("Jobs refused, missed or unsettled: 2" in render_plant(report)) is not fine


def test_a_cell_of_a_plan_that_no_home_noted_is_on_record(tmp_path):
    location = str(tmp_path / "plant.db")
    with FleetStore(location) as store:
        store.add_plan(plan_with(2))
    with PlantNotes(location, "plant") as notes:
        notes.note({"cell-0001": CellState()}, {})
        assert notes.look().unnoted == ("cell-0002",)


def test_a_needle_that_wears_is_the_steepest_trend_and_a_finding():
    cells = {f"c{n}": state_of(f"c{n}") for n in range(4)}
    journals = [
        journal_of(cell, entries(f"epson:{cell}", wear_mm=0.01 if cell == "c2" else 0.0))
        for cell in cells
    ]
    report = made(cells, journals)
    steepest = report.trends[0]
    assert (steepest.cell, steepest.axis, round(steepest.slope_mm, 4)) == ("c2", "z", 0.01)
    assert [(one.cell, one.finding.code) for one in report.findings] == [("c2", "nozzle_worn")]


def test_corrections_are_told_by_recipe_and_one_cell_stands_out():
    cells = {f"c{n}": state_of(f"c{n}") for n in range(3)}
    journals = [
        journal_of("c0", entries("epson:c0")),
        journal_of("c1", entries("epson:c1", recipe="pin")),
        journal_of("c2", entries("epson:c2", last_mm=0.9)),
    ]
    needle, pin = made(cells, journals).corrections
    assert (needle.name, needle.count, pin.name, pin.count) == ("needle", 58, "pin", 29)
    assert [cell for cell, _ in needle.outliers] == ["c2"]
    assert pin.outliers == ()
    assert 0.0 < pin.median_mm < 0.05


def test_only_what_is_of_the_period_counts():
    found = entries("epson:a", wear_mm=0.01)
    report = made({"a": state_of("a")}, [journal_of("a", found)], since=ago(days=4)[:10])
    assert report.change_count == 5
    report = made({"a": state_of("a")}, [journal_of("a", found)], since="2027")
    assert (report.change_count, report.findings, report.corrections) == (0, (), ())


def test_a_record_that_went_to_another_journal_counts_once():
    states = {"a": state_of("a")}
    old = CopiedJournal("PC:shared.db", "", iter(entries("epson:a", count=10)))
    report = made(states, [old, journal_of("a", entries("epson:a"))])
    assert report.change_count == 30


def test_cells_are_grouped_by_the_recipe_that_they_run():
    other = RecipeInUse("needle", "other" * 4, ago(days=2))
    states = {f"c{n}": state_of(f"c{n}") for n in range(3)} | {"d": state_of("d", recipe=other)}
    first, second = made(states, []).recipes
    assert (first.cells, second.cells) == (("c0", "c1", "c2"), ("d",))
    assert second.since == ago(days=2)


def test_a_page_of_many_cells_stays_a_page_and_says_how_many_more():
    states = {f"c{n:04d}": state_of(f"c{n:04d}", unsettled_since=ago(hours=1)) for n in range(2000)}
    report = made(states, [])
    page = render_plant(report)
    assert len(page) < 60_000
    assert f"and {2000 - MOST_ROWS} more" in page


def test_both_languages_and_text_that_somebody_wrote_is_only_text():
    states = {"<b>": state_of("<b>", well=False, verdict="<script>alert(1)</script>")}
    report = made(states, [])
    assert "<script" not in render_plant(report)
    with_chinese = _in_chinese(report)
    assert "需要人员查看" in with_chinese


def _in_chinese(report):
    speak("zh")
    try:
        return render_plant(report)
    finally:
        speak("en")


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_CONFIG", str(tmp_path / "robolink.toml"))
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.delenv("ROBOLINK_JOURNAL", raising=False)
    monkeypatch.delenv("ROBOLINK_PLANT", raising=False)
    monkeypatch.chdir(tmp_path)
    add_cell(tmp_path / "robolink.toml", "a", {"url": "epson+tcp://192.168.0.1:5000"})
    return tmp_path


def recorded():
    """Put the same entries into the journal of the cell, with every pose."""
    address = "epson+tcp://192.168.0.1:5000"
    log = open_journal(address=address).log(address, signature=entries("x", count=1)[0].signature)
    for one in entries(address, count=8):
        poses = {"inputs": [[1.0] * 6] * 20}
        log.append(NewEntry(one.kind, change=one.change, tool=1, details={**one.details, **poses}))
    return open_journal(address=address)


def test_the_command_reads_the_journals_of_this_computer_and_writes_a_page(home, capsys):
    at = home_of(recorded().location)
    with PlantNotes(default_plant(), "plant") as notes:
        notes.note({"a": CellState("epson+tcp://192.168.0.1:5000", at)}, {})
    with FleetStore(default_plant()) as store:
        plan = permitted(store, plan_with(2, name="needles <of> November"))
    assert main.run(["fleet", "report", "plant", "page.html", "--json"]) == 1  # never checked
    document = json.loads(capsys.readouterr().out)
    assert (document["cell_count"], document["change_count"]) == (1, 8)
    assert [one["plan"] for one in document["plans"]] == [plan.id]
    page = (home / "page.html").read_text(encoding="utf-8")
    assert "needles &lt;of&gt; November" in page
    assert main.run(["fleet", "report", "plant", "page.html"]) == 2  # it is there already
    assert main.run(["fleet", "report", "plant", "page.html", "--force"]) == 1
    assert "cells without a recent check" in capsys.readouterr().out


def test_no_page_says_that_all_is_well_with_a_plant_that_nobody_knows(home, capsys):
    assert main.run(["fleet", "report", "plnat", "page.html"]) == 2
    assert "Nothing is on record of a plant plnat." in capsys.readouterr().err
    assert not (home / "page.html").exists()


@pytest.mark.soak
def test_copies_say_what_the_journal_says(home, server):
    journal = recorded()
    server.execute("DROP SCHEMA IF EXISTS fleet CASCADE")
    with journal.outbox(server.url()) as outbox:
        outbox.copy()
    from robolink.config import load_cell_files

    (here,) = own_journals(load_cell_files().cells.values())
    (there,) = copied_journals(server.url())
    assert here.home == there.home
    assert list(map(dataclasses.asdict, here.entries)) == list(
        map(dataclasses.asdict, there.entries)
    )


def test_of_many_names_the_first_are_shown_and_the_others_counted():
    assert some_names(["a", "b"], 2) == "a, b"
    assert some_names(["a", "b", "c"], 2) == "a, b and 1 more"
