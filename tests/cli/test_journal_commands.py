"""journal list, show, diff, export, verify: read only, without a controller."""

import csv
import json
import os
import sqlite3
import subprocess
import sys

import pytest
from robolink_cli import main
from robolink_cli.commands.record.journal_export import COLUMNS
from robolink_cli.views.journal import detail_rows
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.model import EntryKind, NewEntry, Signature
from tests.cli._recorded_changes import (
    FIRST,
    HERE,
    NEW,
    OLD,
    POSES,
    SECOND,
    THERE,
    entry,
    record_changes,
)


@pytest.fixture
def recorded(state_folder):
    return record_changes()


@pytest.fixture
def run(state_folder, capsys):
    def ran(*arguments):
        code = main.run(arguments)
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return ran


@pytest.fixture
def document(run):
    def ran(*arguments):
        code, out, err = run(*arguments, "--json")
        assert (code, err) == (0, "")
        return json.loads(out)

    return ran


def numbers(found):
    return [entry["number"] for entry in found["entries"]]


def test_the_list_shows_the_newest_first_with_value_and_person(run, recorded):
    code, out, _ = run("journal", "list")
    assert code == 0
    lines = [line.split() for line in out.splitlines() if line.strip()[:1].isdigit()]
    assert [line[0] for line in lines] == ["4", "3", "2", "1"]
    assert lines[0][4:] == ["aaaa2222", "1", "done", "undefined", "Ann", "(engineer)"]
    assert "X 12.250 Y -3.500 Z -20.000 U 0.000" in out
    assert HERE in out
    assert THERE in out


FILTERS = {
    "a tool": (["--tool", "1"], [4, 2, 1]),
    "a controller": (["-c", THERE], [3]),
    "a controller before the command": ([], [4, 2, 1]),
    "a kind": (["--kind", "done"], [4, 3, 2]),
    "several kinds": (["--kind", "calibration", "--kind", "read-back"], [1]),
    "a change": (["--change", FIRST[:6]], [2, 1]),
    "a kind of a change": (["--change", FIRST[:6], "--kind", "done"], [2]),
    "no more than": (["--limit", "2"], [4, 3]),
}


@pytest.mark.parametrize("name", FILTERS)
def test_the_list_shows_what_is_asked_for(document, recorded, name):
    options, expected = FILTERS[name]
    before = ["-c", HERE] if name.endswith("before the command") else []
    assert numbers(document(*before, "journal", "list", *options)) == expected


def test_a_cell_stands_for_its_controller(document, recorded, tmp_path):
    (tmp_path / "robolink.toml").write_text(f'[cells.five]\nurl = "{THERE}"\n', encoding="utf-8")
    assert numbers(document("journal", "list", "-c", "five")) == [3]


def test_an_entry_as_a_document_has_its_units_in_its_keys_and_the_stored_details(
    document, recorded
):
    (found,) = document("journal", "show", "2")["entries"]
    assert found["before"]["x_mm"] == 12.0
    assert found["after"]["u_deg"] == 0.0
    assert found["details"]["value"] == NEW
    assert (found["operator"], found["nozzle"], found["change"]) == ("Ann", "N-1", FIRST)
    assert len(found["hash"]) == 64


def test_an_entry_is_shown_with_all_its_fields_and_poses(run, recorded):
    code, out, _ = run("journal", "show", "1")
    assert code == 0
    for words in ("change up to 2 mm", "measured", "Ann", "N-1", "L-7", "12.250", "rms: 0.0125 mm"):
        assert words in out
    assert "1 1.500 2.000 -3.000 90.000 - - right" in " ".join(out.split())
    assert recorded.entry(1).hash in out


def test_what_was_recorded_is_shown_a_row_a_value_with_its_unit():
    details = {
        "facts": {"firmware": "7.5.1", "axes": ["X", "Y"]},
        "budget": {"rows": [{"name": "pin", "u_mm": 0.005}, {"name": "jog", "share_percent": 62}]},
        "speed_s_mm_s": [50, 50.0, None],
        "residuals_mm": [[0.01, -0.01], [0.02, 0.0]],
        "power_high": False,
        "u_deg": 0,
        "said_s": "no figure",
        "gauges": [],
        "evidence": None,
        "remarks": "",
    }
    rows = [f"{name}: {said}" for key in details for name, said in detail_rows(key, details[key])]
    assert rows == [
        "facts firmware: 7.5.1",
        "facts axes: X, Y",
        "budget rows 1 name: pin",
        "budget rows 1 u: 0.005 mm",
        "budget rows 2 name: jog",
        "budget rows 2 share: 62 %",
        "speed s: 50, 50, - mm/s",
        "residuals: 0.01, -0.01; 0.02, 0 mm",
        "power high: no",
        "u: 0 deg",
        "said s: no figure",
    ]


@pytest.mark.parametrize("name", [FIRST, FIRST[:6], FIRST[:5].upper()])
def test_a_change_is_named_by_the_beginning_of_its_id(document, recorded, name):
    assert numbers(document("journal", "show", name)) == [1, 2]


WRONG_NAMES = {
    "aaaa": "2 changes begin with 'aaaa': aaaa2222, aaaa1111",
    "aaa": "neither the number of an entry nor an id",
    "cccc": "No entry and no change in the journal is called 'cccc'",
    "99": "neither the number",
    "99999999999999999999999": "No entry and no change",
    "\u0661": "neither the number",
}


@pytest.mark.parametrize("name", WRONG_NAMES)
def test_a_name_that_means_nothing_or_too_much_is_refused(run, recorded, name):
    code, out, err = run("journal", "show", name)
    assert (code, out) == (2, "")
    assert WRONG_NAMES[name] in err
    assert "robolink journal list" in err


def test_the_difference_of_two_changes(document, run, recorded):
    found = document("journal", "diff", FIRST[:5], "3")
    (tool,) = found["tools"]
    assert tool["tool"] == {"a": 1, "b": 2}
    assert tool["after"]["difference"]["x_mm"] == pytest.approx(-0.25)
    assert tool["before"]["b"] is tool["before"]["difference"] is None
    differing = {field["name"]: (field["a"], field["b"]) for field in found["fields"]}
    assert differing["operator"] == ("Ann", "")
    assert differing["tolerance"] == ("change up to 2 mm", "")
    assert differing["controller"] == (HERE, THERE)
    assert found["poses"] == {"a": POSES, "b": []}
    code, out, _ = run("journal", "diff", FIRST[:5], "3")
    assert code == 0
    shown = " ".join(out.split())
    assert "after difference -0.250 0.000 0.000 0.000 0.000 0.000" in shown
    assert "before entry 3 undefined" in shown


def test_a_change_is_one_side_from_its_first_before_to_its_last_value(document, recorded):
    (tool,) = document("journal", "diff", FIRST[:5], SECOND[:5])["tools"]
    assert tool["tool"] == {"a": 1, "b": 1}
    assert tool["before"]["difference"]["x_mm"] == 0.25
    assert tool["after"]["a"]["x_mm"] == 12.25
    assert tool["after"]["b"] is None


def test_an_old_entry_names_its_method_as_it_is_named_now(document, run, recorded, tmp_path):
    for change, method in (("dddd", "crossed_beams"), ("eeee", "beams")):
        recorded.log(HERE).append(entry(EntryKind.CALIBRATION, change * 8, 1, method=method))
    shown, _ = document("journal", "show", "5")["entries"], run("journal", "export", "as.jsonl")
    assert [one["details"]["method"] for one in shown] == ["beams"]
    assert "method: beams" in run("journal", "show", "5")[1]
    differing = {field["name"] for field in document("journal", "diff", "5", "6")["fields"]}
    assert "method" not in differing
    # The hash covers every letter, so an export keeps them.
    kept = [json.loads(line) for line in (tmp_path / "as.jsonl").read_text().splitlines()]
    assert [one["details"].get("method") for one in kept[-2:]] == ["crossed_beams", "beams"]


def test_a_tool_on_one_side_only_is_named(run, recorded):
    log = recorded.log(HERE)
    log.append(*(entry(EntryKind.DONE, "cccc" * 8, tool, before=OLD, value=NEW) for tool in (1, 5)))
    code, out, _ = run("journal", "diff", "cccc", FIRST[:5])
    assert code == 0
    assert "on one side only: tool 5" in out


def test_an_intact_journal_is_whole(run, document, recorded):
    code, out, _ = run("journal", "verify")
    first, last = out.splitlines()
    assert (code, first) == (0, "4 entries checked: nothing was changed and nothing is missing.")
    newest = next(recorded.entries())
    assert last.startswith(f"The last one is 4, {newest.hash}. Without a key")
    assert document("journal", "verify")["problems"] == []


def test_a_changed_entry_and_a_missing_one_are_named(run, recorded, state_folder):
    with sqlite3.connect(state_folder / "journal.db") as database:
        database.execute("update entries set verdict = 'better' where number = 2")
        database.execute("delete from entries where number = 3")
    database.close()
    code, out, _ = run("journal", "verify")
    assert code == 1
    assert "Entry 2 was changed after it was stored." in out
    assert "Entry 3 is missing." in out
    assert "problems: 2" in out


@pytest.mark.parametrize(
    "arguments", [["show", "1"], ["diff", "1", "2"], ["export", "x.csv"], ["verify"]]
)
def test_a_journal_that_does_not_exist_is_said_so_and_not_made(run, state_folder, arguments):
    code, out, err = run("journal", *arguments)
    assert (code, out) == (2, "")
    assert "There is no journal" in err
    assert not state_folder.exists()


def test_an_empty_list_is_no_error(run, document, state_folder, tmp_path):
    code, out, _ = run("journal", "list")
    assert code == 0
    assert "There is no journal yet" in out
    assert document("journal", "list")["entries"] == []
    assert not state_folder.exists()


def test_a_list_without_a_match_says_so(run, recorded):
    code, out, _ = run("journal", "list", "--tool", "15")
    assert (code, out) == (0, "There is no such entry in the journal.\n")


def test_a_journal_that_may_only_be_read_is_listed_and_exported(document, recorded, state_folder):
    recorded.close()
    folder_mode = state_folder.stat().st_mode
    (state_folder / "journal.db").chmod(0o400)
    state_folder.chmod(0o500)
    try:
        assert numbers(document("journal", "list", "--limit", "1")) == [4]
        assert document("journal", "export", "all.jsonl")["entry_count"] == 4
    finally:
        state_folder.chmod(folder_mode)


def test_a_journal_that_another_program_writes_is_listed(document, recorded, state_folder):
    other = sqlite3.connect(state_folder / "journal.db", isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    try:
        assert numbers(document("journal", "list", "--limit", "1")) == [4]
    finally:
        other.close()


def test_a_newer_journal_is_exported_but_not_verified(run, document, recorded, state_folder):
    recorded.close()
    with sqlite3.connect(state_folder / "journal.db") as database:
        database.execute("update schema_version set version = 99")
    database.close()
    assert document("journal", "export", "all.jsonl")["entry_count"] == 4
    code, _, err = run("journal", "verify")
    assert (code, "newer robolink" in err) == (2, True)


LOOKS = """
import sys
from robolink_cli import main
def loaded(*names):
    print("loaded:", [name for name in sys.modules if name.startswith(names)])
main.run(["journal", "list"])
loaded("robolink.controllers", "numpy", "pymodbus", "can", "serial")
main.run(["cell", "list"])
main.run(["cell", "files"])
loaded("numpy", "pymodbus", "can", "serial")
main.run(["-c", sys.argv[1], "tool", "get", "1"])
loaded("numpy", "PIL", "cv2", "robolink.eye")
import robolink.calibration, robolink_cli.views.documents
import robolink_cli.commands.measure.calibrate
loaded("numpy")
"""


def test_looking_at_journal_cells_and_tools_loads_no_driver_eye_or_mathematics(recorded):
    with serve_tcp(EpsonSimulator(seed=4)) as host:
        shown = subprocess.run(
            [sys.executable, "-c", LOOKS, host.url],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
            capture_output=True,
            text=True,
            check=True,
            timeout=60,
        )
    found = [line for line in shown.stdout.splitlines() if line.startswith("loaded:")]
    assert found == ["loaded: []"] * 4
    assert "12.000" in shown.stdout  # the tool was read


# journal export: CSV for a spreadsheet, JSON and JSON lines for programs.


def test_an_export_as_csv_has_units_in_its_columns_and_every_entry(run, recorded, tmp_path):
    recorded.log(HERE, signature=Signature(operator="=cmd()")).append(
        NewEntry(EntryKind.DECISION, verdict='"quoted",\nand 汉字')
    )
    code, out, _ = run("journal", "export", "all.csv")
    assert (code, out) == (0, "5 entries were written to all.csv.\n")
    with (tmp_path / "all.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(COLUMNS)
    assert [row["number"] for row in rows] == ["1", "2", "3", "4", "5"]
    assert [row["after_x_mm"] for row in rows] == ["12.25", "12.25", "12.0", "", ""]
    assert rows[0]["rms_mm"] == "0.0125"
    assert rows[4]["operator"] == "'=cmd()"
    assert rows[4]["verdict"] == '"quoted",\nand 汉字'
    assert json.loads(rows[1]["details"])["value"] == NEW


@pytest.mark.parametrize("name", ["some.json", "some.jsonl"])
def test_an_export_for_programs_holds_what_was_asked_for(run, recorded, tmp_path, name):
    code, out, _ = run("journal", "export", name, "--tool", "1", "--json")
    assert (code, json.loads(out)["entry_count"]) == (0, 3)
    text = (tmp_path / name).read_text(encoding="ascii")
    found = (
        json.loads(text)["entries"]
        if name.endswith("json")
        else [json.loads(line) for line in text.splitlines()]
    )
    assert [entry["number"] for entry in found] == [1, 2, 4]
    assert found[0]["after"]["x_mm"] == 12.25


def test_an_export_of_nothing_is_still_a_whole_file(run, recorded, tmp_path):
    for name in ("none.csv", "none.json", "none.jsonl"):
        assert run("journal", "export", name, "--tool", "15")[0] == 0
    assert json.loads((tmp_path / "none.json").read_text(encoding="ascii"))["entries"] == []
    assert (tmp_path / "none.csv").read_text(encoding="utf-8-sig").startswith("number,")
    assert (tmp_path / "none.jsonl").read_bytes() == b""


def test_an_export_never_writes_over_a_file_unasked(run, recorded, tmp_path):
    (tmp_path / "all.csv").write_text("mine", encoding="ascii")
    code, _, err = run("journal", "export", "all.csv")
    assert (code, "exists already" in err) == (2, True)
    assert (tmp_path / "all.csv").read_text(encoding="ascii") == "mine"
    assert run("journal", "export", "all.csv", "--force")[0] == 0
    assert (tmp_path / "all.csv").read_text(encoding="utf-8-sig").startswith("number")


def test_the_form_of_an_export_is_asked_for_by_name_or_option(run, recorded, tmp_path):
    code, _, err = run("journal", "export", "all.xlsx")
    assert (code, ".csv" in err) == (2, True)
    assert run("journal", "export", "all.xlsx", "--format", "jsonl")[0] == 0
    assert (tmp_path / "all.xlsx").read_bytes().count(b"\n") == 4
