"""The commands about plans, as a person types them; the documents are checked by the suite."""

import json
import os
import shutil
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_cli.console.person import Person, person_at

from robolink.fleet import (
    CellState,
    FleetStore,
    JobOutcome,
    PlanError,
    PlantNotes,
    RecipeInUse,
    default_plant,
)
from tests.fleet._plans import carried_out, cells_of

PLAN = """
schema = "robolink/fleet-plan/1"
kind = "offset"
name = "needles of November"
cells = ["cell-*"]
rings = [1, "rest"]
window = "00:00-23:59"
"""


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Run a command line in a folder with cells and a plan file."""
    for name in [name for name in os.environ if name.startswith("ROBOLINK")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    cells = cells_of(4)
    urls = "".join(f'[cells.{cell}]\nurl = "epson+tcp://192.0.2.1:5000"\n' for cell in cells)
    Path("robolink.toml").write_text(urls)
    offsets = "".join(f"[offsets.{cell}]\ntool = 1\nx_mm = 12.0\n" for cell in cells)
    Path("plan.toml").write_text(PLAN + offsets)

    def run_it(*arguments):
        capsys.readouterr()
        code = main.run(["fleet", *arguments])
        out, err = capsys.readouterr()
        return code, out, err

    return run_it


@pytest.fixture
def document(run):
    """Run a command line with --json; return its document."""

    def run_it(*arguments):
        code, out, err = run(*arguments, "--json")
        assert code == 0, err
        return json.loads(out)

    return run_it


@pytest.fixture
def plan(document):
    """A plan that was started."""
    made = document("plan", "plan.toml")["plan"]
    with FleetStore(default_plant()) as store:
        store.resume(made, "Li", "started")
    return made


def test_a_plan_is_made_kept_and_listed(run, document, plan):
    (line,) = document("status")["plans"]
    assert (line["plan"], line["cell_count"], line["states"]["waiting"]) == (plan, 4, 4)
    code, out, _ = run("status")
    assert code == 0
    assert plan in out
    assert "offset: needles of November" in out


def test_a_dry_run_keeps_nothing(run, document):
    assert document("plan", "plan.toml", "--dry-run")["kept"] is False
    assert "Nothing was kept." in run("plan", "plan.toml", "--dry-run")[1]
    assert document("status") == {"schema": "robolink/fleet-plans/1", "homes": [], "plans": []}
    assert not Path(default_plant()).exists()


def test_a_group_of_the_cell_files_names_cells_of_a_plan(run, document):
    with Path("robolink.toml").open("a") as cells:
        cells.write('[groups]\nfirst = ["cell-0001", "cell-0002"]\n')
    Path("check.toml").write_text(
        'schema = "robolink/fleet-plan/1"\nkind = "check"\nname = "n"\ncells = ["@first"]\n'
    )
    assert document("plan", "check.toml")["rings"] == [["cell-0001", "cell-0002"]]


def test_every_waiting_job_says_why(run, document, plan):
    jobs = document("status", plan)["jobs"]
    assert [job["why"] for job in jobs] == ["permit", "ring", "ring", "ring"]
    code, out, _ = run("status", plan)
    assert code == 0
    assert "3 waiting: an earlier ring is not finished" in out
    assert "1 waiting: no permit holds now" in out
    assert document("status", plan, "--why", "cell-0002")["why"] == "ring"
    assert "an earlier ring is not finished" in run("status", plan, "--why", "cell-0002")[1]


def test_a_permit_is_given_listed_and_revoked(run, document, plan):
    given = document("permit", "give", "Chen", "--until", "2099-01-01", "--operator", "Li")
    assert (given["person"], given["role"], given["plant"]) == ("Chen", "engineer", "plant")
    assert given["given_by"].startswith("Li (")
    assert document("status", plan, "--why", "cell-0001")["why"] == "turn"
    del given["schema"]
    assert document("permit", "list")["permits"] == [given]
    assert document("permit", "revoke", "1")["revoked_by"]
    assert document("status", plan, "--why", "cell-0001")["why"] == "permit"
    assert "revoked by" in run("permit", "list")[1]


def test_a_plan_is_halted_and_goes_on(run, document, plan):
    halted = document("halt", plan, "--reason", "the line stands", "--operator", "Li")
    assert halted["halt"]["numbers"] == {"reason": "the line stands"}
    assert document("status", plan, "--why", "cell-0001")["why"] == "halted"
    assert "halted it: the line stands" in run("status", plan)[1]
    (lifted,) = document("resume", plan, "--reason", "the line runs")["lifted"]
    assert lifted["reason"] == "the line runs"
    code, _, err = run("resume", plan, "--reason", "again")
    assert code == 2
    assert "is not halted" in err


@pytest.mark.parametrize("waits", ["permit", pytest.param("window", marks=pytest.mark.soak)])
def test_run_says_that_not_everything_was_done(run, document, waits, engine_file):
    """Nothing runs, nothing is halted: it waits for a permit, or for its window."""
    if waits == "window":
        hour = (datetime.now().astimezone() + timedelta(hours=2)).hour
        window = f"{hour:02}:00-{(hour + 1) % 24:02}:00"
        Path("plan.toml").write_text(
            'schema = "robolink/fleet-plan/1"\nkind = "drift"\nname = "n"\ncells = ["*"]\n'
            f'window = "{window}"\n'
        )
    made = document("plan", "plan.toml")["plan"]
    shutil.copy(engine_file, Path("state") / "fleet.db.jobs")
    code, out, _ = run("run", made)
    assert code == 1
    assert "waiting" in out
    assert document("status", made)["halts"][0]["reason"] == "started"


def test_a_plan_that_moves_robots_is_started_and_begun_at_its_cells(run, document):
    recipe = Path(__file__).parents[2] / "examples" / "recipes" / "scara-pin.toml"
    Path("plan.toml").write_text(
        'schema = "robolink/fleet-plan/1"\nkind = "recipe"\nname = "n"\ncells = ["*"]\n'
        f"recipe = {json.dumps(str(recipe))}\n"
    )
    code, out, _ = run("plan", "plan.toml")
    assert code == 0
    made = document("status")["plans"][0]["plan"]
    begun = f"robolink -c CELL fleet next {made}"
    assert begun in out
    assert f"robolink fleet run {made}" in out
    assert f"not started yet: robolink fleet run {made}" in run("status", made)[1]
    code, out, _ = run("run", made)
    assert (code, begun in out) == (1, True)
    (started,) = document("status", made)["halts"]
    assert (started["rule"], started["reason"]) == ("pause", "started")
    document("halt", made)
    code, out, _ = run("resume", made, "--reason", "the line runs")
    assert (code, begun in out) == (0, True)


def test_run_lifts_no_halt_of_a_person(run, document):
    made = document("plan", "plan.toml")["plan"]
    document("halt", made, "--reason", "the needles are wrong", "--operator", "Li")
    code, _, err = run("run", made)
    assert code == 2
    assert "halted it: the needles are wrong" in err
    assert "Nothing was started." in err
    halts = document("status", made)["halts"]
    assert [(one["rule"], one["lifted_by"]) for one in halts] == [("pause", None), ("person", None)]


def test_a_plan_is_cancelled_for_good(run, document, plan):
    assert document("halt", plan, "--cancel")["cancelled_count"] == 4
    code, _, err = run("resume", plan, "--reason", "after all")
    assert code == 2
    assert "was cancelled" in err
    status = document("status", plan)
    assert status["finished"] is True
    assert {job["why"] for job in status["jobs"]} == {None}


def test_what_is_left_for_a_person_is_told_with_its_cause(run, document, plan):
    document("permit", "give", "Chen", "--until", "2099-01-01")
    with FleetStore(default_plant()) as store:
        outcome = JobOutcome(6, "OutcomeUnknownError", what="No answer came.")
        carried_out(store, store.plan(plan), "cell-0001", outcome)
    code, out, _ = run("status", plan)
    assert code == 0
    assert "cell-0001: unsettled; next: robolink recover: OutcomeUnknownError No answer" in out
    assert f"robolink fleet resume {plan} --reason" in out
    *_, halt = document("status", plan)["halts"]
    assert (halt["rule"], halt["cell"]) == ("unsettled", "cell-0001")


@pytest.mark.parametrize(
    "arguments",
    [
        ["status", "0123456789ab"],
        ["halt", "0123456789ab"],
        ["resume", "0123456789ab", "--reason", "x"],
        ["permit", "revoke", "7"],
        ["permit", "give", "Chen", "--until", "2099-01-01"],
    ],
)
def test_nothing_is_made_by_a_command_about_no_plan(run, arguments):
    code, _, err = run(*arguments)
    assert code == 2
    assert "There is no plan yet." in err
    assert not Path(default_plant()).exists()


def test_a_journal_is_no_plants_database(run, monkeypatch, tmp_path):
    from robolink.journal import open_journal

    path = tmp_path / "journal.db"
    open_journal(str(path)).close()
    monkeypatch.setenv("ROBOLINK_PLANT", str(path))
    code, _, err = run("plan", "plan.toml")
    assert code == 2
    assert "is a journal, not a plant's database" in err


def test_a_database_that_cannot_be_used_is_named_without_its_password(run, monkeypatch):
    monkeypatch.setenv("ROBOLINK_PLANT", "postgresql://li:secret-7@127.0.0.1:1/plant")
    code, _, err = run("status")
    assert code == 2
    assert "The plant's database postgresql+psycopg://li:***@127.0.0.1:1/plant cannot be" in err
    assert "secret-7" not in err


def test_an_agent_whose_plant_is_not_named_is_that_of_the_plant_called_plant(run):
    code, out, err = run("agent", "--systemd")
    assert (code, err) == (0, "")
    assert "Description=robolink: the agent of plant plant" in out
    assert " fleet agent plant\n" in out


def test_the_cells_of_a_plant_are_shown_with_their_recipes(run, document):
    assert document("status", "--cells", "plant") == {
        "schema": "robolink/fleet-cells/1",
        "plant": "plant",
        "cells": [],
    }
    assert "Nothing was noted of any cell yet" in run("status", "--cells", "plant")[1]
    recipe = RecipeInUse("needle", "ab" * 32, "2026-11-30T22:00:00+00:00")
    state = CellState("epson:C-1/R-1", changes={"done": 3}, recipe=recipe)
    begun = replace(state, unsettled_since="2026-11-30T22:10:00+00:00")
    with PlantNotes(default_plant(), "plant") as notes:
        notes.note({"line3-a": state, "line3-b": begun}, {})
    first, second = document("status", "--cells", "plant")["cells"]
    assert (first["cell"], first["recipe"]["hash"]) == ("line3-a", "ab" * 32)
    assert (first["changes"]["done"], first["unsettled_since"]) == (3, None)
    assert second["unsettled_since"] == "2026-11-30T22:10:00+00:00"
    out = run("status", "--cells", "plant")[1]
    assert "needle abababababab" in out
    assert "unfinished since 2026-11-30" in out
    assert document("status", "--cells", "other plant")["cells"] == []


@pytest.fixture
def halted_twice(document, plan):
    """A plan that two people have halted; its pause before the start is lifted."""
    for who in ("Li", "Chen"):
        document("halt", plan, "--operator", who, "--reason", f"{who} looks")
    return plan


def standing(plan):
    with FleetStore(default_plant()) as store:
        return [one.number for one in store.progress(plan).standing]


def test_of_several_halts_only_those_that_were_seen_are_lifted(run, document, halted_twice):
    first, second = standing(halted_twice)
    code, out, err = run("resume", halted_twice, "--reason", "all is well")
    assert code == 2
    assert f"halt {first}: " in err
    assert "Li looks" in err
    assert f"--halt {second}" in err
    assert f"halt {second}: " in run("status", halted_twice)[1]
    code, _, err = run("resume", halted_twice, "--reason", "r", "--halt", "99")
    assert (code, "no halt 99" in err) == (2, True)
    assert standing(halted_twice) == [first, second]
    said = document("resume", halted_twice, "--reason", "Li has looked", "--halt", str(first))
    assert [one["number"] for one in said["lifted"]] == [first]
    assert [one["number"] for one in said["halts"]] == [second]
    code, out, _ = run("resume", halted_twice, "--reason", "Chen has looked")
    assert (code, f"Plan {halted_twice} goes on." in out) == (0, True)
    assert standing(halted_twice) == []


@pytest.mark.parametrize(("answer", "code"), [("n\n", 9), ("y\n", 0)])
def test_a_halt_that_comes_while_somebody_reads_the_others_stays(
    run, halted_twice, monkeypatch, answer, code
):
    def answered(_operator, _question, _answer):
        with FleetStore(default_plant()) as store:
            store.halt(halted_twice, "Wu", "smoke")
        return answer == "y\n"

    monkeypatch.setattr("robolink.runner.ask_yes_no", answered)
    before = standing(halted_twice)
    with person_at(Person.TERMINAL):
        found, out, err = run("resume", halted_twice, "--reason", "all is well")
    assert found == code
    assert "Li looks" in err
    assert "Chen looks" in err
    *others, late = standing(halted_twice)
    assert others == ([] if code == 0 else before)
    assert late > before[-1]
    assert ("is halted still" in out, "smoke" in out) == (code == 0, code == 0)


def test_an_agent_without_a_plant_is_that_of_the_plant_called_plant(run, monkeypatch):
    asked = []

    def refused(plant, _backups):
        asked.append(plant)
        raise PlanError("not here")

    monkeypatch.setattr("robolink_cli.commands.fleet.agent.agent_here", refused)
    assert run("agent")[0] == run("agent", "other")[0] == 2
    assert asked == ["plant", "other"]
