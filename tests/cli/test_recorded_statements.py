"""What a measurement stated is read back from its record: journal show, diff, and the report."""

import csv
import json
from dataclasses import replace

import pytest
from robolink_cli import main

from robolink.calibration import (
    AccuracyFacts,
    Drift,
    TurnClaim,
    VerifyResult,
    assessed,
    held_to_claim,
    solve_two_pose,
)
from robolink.calibration_run import AcceptanceCriteria, Proposal, Seating
from robolink.calibration_run._records import calibration_entry, verification_entry
from robolink.journal import open_journal
from robolink.model import EntryKind, NewEntry, Pose, Signature, ToolOffset, plain_offset

TOUCHES = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
OLD = ToolOffset(12.0, -4.0, -20.0)
CLAIM = TurnClaim(
    look_sigma_mm=0.003,
    offset_sigma_mm=0.003,
    headings_deg=(0,),
    finds_place=False,
    place_u_mm=0.0115,
    accurate_mm=0.028,
)


def record(*, sigma_mm=None, drift_mm=0.06, wider_mm=None, damaged=False, claim=CLAIM):
    """Put a change on record, and return the number of its first entry."""
    found = assessed(solve_two_pose(*TOUCHES, stored=OLD, sigma_mm=sigma_mm), AccuracyFacts())
    proposal = Proposal(1, OLD, found, seating=Seating((0.05, 0.05, 0.05), changes=12))
    shown = VerifyResult((Drift(180.0, drift_mm, 0.0),), 0.2)
    proof = VerifyResult(shown.drifts, 0.2, judgement=held_to_claim(claim, shown))
    measured = calibration_entry(proposal, AcceptanceCriteria(), source="touched")
    if damaged:
        details = {**measured.details, "accuracy": {"rows": "torn"}}
        measured = replace(measured, details=details)
    value = plain_offset(found.offset)
    entries = (
        measured,
        NewEntry(
            EntryKind.INTENT, tool=1, details={"before": plain_offset(OLD), "requested": value}
        ),
        NewEntry(EntryKind.WRITE, tool=1),
        NewEntry(EntryKind.READ_BACK, tool=1, details={"value": value}),
        verification_entry(1, proof),
        NewEntry(EntryKind.DONE, tool=1, details={"value": value, "accurate_to_mm": wider_mm}),
    )
    journal = open_journal()
    log = journal.log("epson+tcp://192.168.0.1:5000", signature=Signature(os_user="cell"))
    before = journal.count()
    log.append(*(_of_one_change(entry, before) for entry in entries))
    journal.close()
    return before + 1


def _of_one_change(entry, before):
    return replace(entry, change=f"c0ffee{before:04d}", operation="o")


@pytest.fixture
def shown(state_folder, capsys):
    def ran(*words):
        assert main.run(words) == 0
        out = capsys.readouterr().out
        return json.loads(out) if "--json" in words else " ".join(out.split())

    return ran


def test_an_entry_says_both_statements_its_rows_and_the_seating(shown):
    text = shown("journal", "show", str(record()))
    for said in (
        "Repeatable: not known (two touches cannot check each other).",
        "X, Y: accurate to +-0.088 mm (95 %).",
        "Largest row: how a person sees contact, +-0.05 mm (default, not measured).",
        "Seating: mounted anew, the tip lies within +-0.130 mm of here (95 %, 12 changes).",
        "how a person sees contact +-0.05 mm default, not measured",
    ):
        assert said in text
    assert "not assessed" not in text
    assert "accuracy rows" not in text


def test_the_entry_of_a_turn_test_says_what_it_contradicts(shown):
    text = shown("journal", "show", str(record(sigma_mm=0.02) + 4))
    assert "Scatter alone explains 0.0" in text
    assert "it does not repeat as stated" in text


def test_the_entry_and_the_page_say_what_the_turn_test_would_not_show(shown, tmp_path):
    page, said = tmp_path / "page.html", "less than 0.022 mm (X, Y) may not show."
    record(sigma_mm=0.02, drift_mm=0.004, claim=replace(CLAIM, accurate_mm=0.02))
    assert said in shown("journal", "show", "5")
    (tool,) = shown("journal", "report", "c0ffee", str(page), "--json")["tools"]
    assert tool["verification"]["judgement"]["shows_from_mm"] == pytest.approx(0.0222, abs=1e-4)
    assert said in page.read_text(encoding="utf-8")
    less = record(sigma_mm=0.02, drift_mm=0.004)
    assert "may not show" not in shown("journal", "show", str(less + 4))


def test_a_damaged_statement_is_shown_as_it_stands(shown):
    text = shown("journal", "show", str(record(damaged=True)))
    assert "accuracy rows: torn" in text


def test_two_changes_differ_in_what_they_are_repeatable_and_accurate_to(shown):
    first, second = record(), record(sigma_mm=0.02)
    fields = shown("journal", "diff", str(first), str(second), "--json")["fields"]
    differing = {field["name"]: (field["a"], field["b"]) for field in fields}
    assert differing["repeatable_to_mm"] == ("", "0.035")
    assert differing["accurate_to_mm"] == ("0.088", "0.079")


def test_a_report_has_the_statement_that_stands_and_is_no_proof_with_a_doubt(shown, tmp_path):
    record(sigma_mm=0.02, wider_mm=0.15)
    page = tmp_path / "page.html"
    (tool,) = shown("journal", "report", "c0ffee", str(page), "--json")["tools"]
    assert tool["repeatable_to_mm"] == pytest.approx(0.0346, abs=1e-4)
    assert tool["accurate_to_mm"] == 0.15
    assert tool["accuracy"]["within_mm"] == pytest.approx(0.0786, abs=1e-4)
    assert tool["seating"]["changes"] == 12
    assert tool["verification"]["judgement"]["code"] == "proof_contradicts_repeatability"
    text = page.read_text(encoding="utf-8")
    for said in (
        "Written and read back; the turn test leaves a doubt",
        "X, Y: repeatable to ± 0.035 mm (95 %).",
        "X, Y: accurate to ± 0.150 mm (95 %), widened after the turn test.",
        "Seating: mounted anew, the tip lies within ± 0.130 mm of here",
        "It contradicts the measurement",
        "Conformity is not stated: the turn test leaves a doubt.",
    ):
        assert said in text
    assert "dashed circle, radius 0.1500 mm" in text
    assert "accurate to, 95 %" not in text  # that of each axis alone no longer stands
    assert "The tool conforms" not in text


def test_a_drift_that_the_accuracy_covers_is_a_doubt_on_the_page(shown, tmp_path):
    record(sigma_mm=0.02, drift_mm=0.02)
    page = tmp_path / "page.html"
    shown("journal", "report", "c0ffee", str(page), "--json")
    text = page.read_text(encoding="utf-8")
    assert "Within its limit, with a doubt" in text
    assert "Written and read back; the turn test leaves a doubt" in text


def test_a_report_of_a_good_change_conforms(shown, tmp_path):
    record(sigma_mm=0.02, drift_mm=0.004)
    page = tmp_path / "page.html"
    shown("journal", "report", "c0ffee", str(page), "--json")
    text = page.read_text(encoding="utf-8")
    assert "Written, read back and tested" in text
    assert "It contradicts nothing that is stated" in text
    assert "X, Y: accurate to ± 0.079 mm (95 %)." in text
    assert "accurate to, 95 %" in text
    assert "not on record</td>" not in text


def test_a_table_for_a_spreadsheet_has_both_figures(shown, tmp_path):
    record(sigma_mm=0.02, wider_mm=0.15)
    shown("journal", "export", str(tmp_path / "all.csv"))
    with (tmp_path / "all.csv").open(encoding="utf-8-sig", newline="") as file:
        measured, *_, kept = csv.DictReader(file)
    assert float(measured["repeatable_to_mm"]) == pytest.approx(0.0346, abs=1e-4)
    assert float(measured["accurate_to_mm"]) == pytest.approx(0.0786, abs=1e-4)
    assert float(kept["accurate_to_mm"]) == 0.15


@pytest.mark.parametrize("z_from", ["kept", "typed", "measured"])
def test_a_z_that_was_kept_or_typed_is_not_called_measured(z_from):
    found = solve_two_pose(*TOUCHES, stored=OLD)
    entry = calibration_entry(
        Proposal(1, OLD, found, z_from=z_from), AcceptanceCriteria(), source="touched"
    )
    own, _, others = entry.verdict.partition("; not measured: ")
    assert own.startswith("measured: X 12.000 Y -4.000"), entry.verdict
    assert ("Z -20.000" in own, "Z -20.000" in others) == (
        z_from == "measured",
        z_from != "measured",
    )
    assert others.endswith("U 0.000")
