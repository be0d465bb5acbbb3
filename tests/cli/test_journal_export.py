"""journal export: CSV for a spreadsheet, JSON and JSON lines for programs."""

import csv
import json

import pytest
from robolink_cli import main
from robolink_cli.commands.record.journal_export import COLUMNS

from robolink.model import EntryKind, NewEntry, Signature
from tests.cli._recorded_changes import HERE, NEW, record_changes


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
