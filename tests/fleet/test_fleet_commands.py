"""The commands about plans, as a person types them; the documents are checked by the suite."""

import json
import os
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from robolink_cli import main

from robolink.fleet import FleetStore, JobOutcome, default_plant
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
    document("resume", made, "--reason", "started")
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
    assert document("status") == {"schema": "robolink/fleet-plans/1", "plans": []}
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


@pytest.mark.parametrize("waits", ["permit", "window"])
def test_run_says_that_not_everything_was_done(run, document, waits):
    """Nothing runs, nothing is halted: it waits for a permit, or for its window."""
    if waits == "window":
        hour = (datetime.now().astimezone() + timedelta(hours=2)).hour
        window = f"{hour:02}:00-{(hour + 1) % 24:02}:00"
        Path("plan.toml").write_text(
            'schema = "robolink/fleet-plan/1"\nkind = "drift"\nname = "n"\ncells = ["*"]\n'
            f'window = "{window}"\n'
        )
    made = document("plan", "plan.toml")["plan"]
    code, out, _ = run("run", made)
    assert code == 1
    assert "waiting" in out
    assert document("status", made)["halts"][0]["reason"] == "started"


def test_a_plan_that_moves_robots_says_that_no_agent_carries_it_out(run, document):
    recipe = Path(__file__).parents[2] / "examples" / "recipes" / "scara-pin.toml"
    Path("plan.toml").write_text(
        'schema = "robolink/fleet-plan/1"\nkind = "recipe"\nname = "n"\ncells = ["*"]\n'
        f"recipe = {json.dumps(str(recipe))}\n"
    )
    code, out, _ = run("plan", "plan.toml")
    assert code == 0
    assert "no agent carries it out" in out
    assert "fleet run" not in out
    made = document("status")["plans"][0]["plan"]
    assert f"robolink fleet resume {made} --reason" in out
    assert f"not started yet: robolink fleet resume {made}" in run("status", made)[1]
    code, _, err = run("run", made)
    assert code == 2
    assert "A program of the plant carries it out" in err
    code, out, _ = run("resume", made, "--reason", "the program runs")
    assert code == 0
    assert "no agent carries it out" in out


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
