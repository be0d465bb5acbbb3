"""Results read back from a journal: charts of drift, and the statement of a measurement."""

import csv
import itertools
import json
import re
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
from tests.drift._courses import course

# ``journal drift``: charts from a real journal, on the terminal, as JSON, as a page.

HERE, THERE = "epson+tcp://192.168.0.1:5000", "epson+tcp://192.168.0.2:5000"
METHOD = {"method": "n_angle", "measured": ["x_mm", "y_mm"]}


@pytest.fixture
def run(state_folder, capsys):
    def ran(*arguments):
        code = main.run(("journal", "drift", *arguments))
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return ran


def entries(change, *, end=EntryKind.DONE, z_from="kept", method="n_angle", stated=None):
    """Return the entries of a nozzle change."""
    tip = [change.tip_mm["x"], change.tip_mm["y"], change.tip_mm["z"], 0.0, 0.0, 0.0]
    place = [change.pin_mm["x"], change.pin_mm["y"]]
    told = {
        EntryKind.CALIBRATION: {
            **METHOD,
            "method": method,
            "proposed": tip,
            "tip": tip,
            "reference_point_mm": place,
            **({} if stated is None else {"repeatable_to_mm": stated[0]}),
        },
        EntryKind.VERIFY: {"max_drift_mm": change.turn_test_mm, "passed": True},
        end: {"value": tip, "z_from": z_from}
        | ({} if stated is None else {"accurate_to_mm": stated[1]}),
    }
    return [
        NewEntry(kind, change=change.change, operation="o", tool=change.tool, details=details)
        for kind, details in told.items()
    ]


def record(changes, controller=HERE, **how):
    journal = open_journal()
    for change, nozzle in zip(changes, itertools.count(1), strict=False):
        signature = Signature(os_user="cell", station="PIN-07", nozzle=f"N-{nozzle}")
        journal.log(controller, signature=signature).append(*entries(change, **how))
    journal.close()


def charted(out):
    return {
        cell["controller"]: {
            (c["quantity"], c["subject"], c["axis"]): [p["value_mm"] for p in c["points"]]
            for c in cell["charts"]
        }
        for cell in json.loads(out)["controllers"]
    }


def test_without_a_journal_nothing_is_on_record(run):
    assert run() == (0, "No measured change is on record here.\n", "")
    assert json.loads(run("--json")[1])["controllers"] == []


def test_the_charts_hold_what_was_measured_and_kept(run):
    changes = course(1, 6)
    record(changes[:4], z_from="measured")
    record(changes[4:5], end=EntryKind.ROLLED_BACK)
    record(changes[5:], end=EntryKind.REFUSED)
    code, out, _ = run("--json")
    (charts,) = charted(out).values()
    assert code == 0
    kept = [change.tip_mm["x"] for change in changes[:4]]
    assert charts["tip", 1, "x"] == pytest.approx(kept)
    assert len(charts["tip", 1, "z"]) == len(charts["turn test", 1, None]) == 4
    pins = [change.pin_mm["y"] for change in changes[:4] if change.pin_mm]
    assert charts["pin", "PIN-07", "y"] == pytest.approx(pins)


def test_one_change_draws_no_empty_table_and_is_headed_by_the_cell_that_was_named(
    run, tmp_path, capsys
):
    (tmp_path / "robolink.toml").write_text(f'[cells.line3]\nurl = "{HERE}"\n')
    record(course(1, 1))
    code, out, _ = run("-c", "line3")
    assert code == 0
    first, *rest = out.splitlines()
    assert first.startswith(f"line3 ({HERE}): measured changes: 1, ")
    assert "needs two measured changes of a tool" in rest[0]
    assert "limits" not in out
    assert run("-c", HERE)[1].startswith(f"{HERE}: "), "a URL is no name"
    before = main.run(["-c", "line3", "journal", "drift"])
    assert (before, capsys.readouterr().out) == (code, out)


def test_a_kept_z_is_not_charted_and_a_used_pin_is_not_found(run):
    record(course(1, 3), method="one-touch")
    (charts,) = charted(run("--json")[1]).values()
    assert set(charts) == {("tip", 1, "x"), ("tip", 1, "y"), ("turn test", 1, None)}


def test_a_slipping_mount_is_said_drawn_and_ends_with_1(run):
    moved = course(1, 32, shift=lambda i, _: (0.1 * (i >= 25), 0, 0))
    record(moved)
    code, out, _ = run()
    assert code == 1
    assert "Tool 1 has moved sideways by X +0." in out
    assert "The mount may slip" in out
    drawn = [
        line for line in out.splitlines() if re.fullmatch(r"[ \d.-]{10}[ .\-oX+]*[.\-oX+]", line)
    ]
    assert sum(line[10:].count("X") for line in drawn) >= 3
    assert max(map(len, drawn)) <= 72
    said = re.search(r"Weighted mean ([\d.]+) mm, outside its limits ([\d.]+) to ([\d.]+) mm", out)
    assert said is not None
    assert float(said[2]) < float(said[3]) < float(said[1])
    (cell,) = json.loads(run("--json")[1])["controllers"]
    (finding,) = cell["findings"]
    assert finding["code"] == "mount_shifted"
    assert finding["subject"] == [1]


def test_the_last_change_says_what_it_is_repeatable_and_accurate_to(run, tmp_path):
    record(course(1, 6), stated=(0.0001, 0.0644))
    code, out, _ = run()
    said = "Tool 1, last change: repeatable to +-0.001 mm, accurate to +-0.064 mm (95 %)."
    assert (code, said in " ".join(out.split())) == (0, True)
    _, out, _ = run("--json")
    point = json.loads(out)["controllers"][0]["charts"][0]["points"][-1]
    assert (point["repeatable_to_mm"], point["accurate_to_mm"]) == (0.0001, 0.0644)
    page = tmp_path / "drift.html"
    run("--page", str(page))
    assert "accurate to ± 0.064 mm (95 %)" in page.read_text(encoding="utf-8")


def test_a_record_without_statements_says_none(run):
    record(course(1, 6))
    _, out, _ = run()
    assert "accurate" not in out


def test_several_cells_stand_beside_each_other(run):
    record(course(1, 22))
    record(course(2, 32, shift=lambda i, _: (0.1 * (i >= 25), 0, 0)), THERE)
    code, out, _ = run("--json")
    found = {c["controller"]: len(c["findings"]) for c in json.loads(out)["controllers"]}
    assert (code, found) == (1, {HERE: 0, THERE: 1})
    assert run("-c", HERE)[0] == 0
    assert set(charted(run("-c", THERE, "--json")[1])) == {THERE}


def test_a_new_beginning_forgets_what_was_before(run):
    record(course(1, 32, shift=lambda i, _: (0.1 * (i >= 25), 0, 0)))
    assert run()[0] == 1
    assert run("--since", "2100-01-01") == (0, "No measured change is on record here.\n", "")
    code, _, err = run("--since", "yesterday")
    assert code == 2
    assert "yesterday" in err


def test_what_a_simulator_measured_is_told_from_what_says_nothing(run):
    record(course(1, 3))
    record(course(1, 3), "epson:C-SIM7782B265")
    _, out, _ = run()
    assert f"{HERE}: measured changes: 3" in out
    assert "epson:C-SIM7782B265 (SIMULATED): measured changes: 3" in out
    assert out.count("SIMULATED") == 1
    _, out, _ = run("--json")
    told = {one["controller"]: one["simulated"] for one in json.loads(out)["controllers"]}
    assert told == {HERE: False, "epson:C-SIM7782B265": True}


def test_the_page_has_every_chart_and_escapes_what_people_typed(run, tmp_path):
    record(course(1, 32, shift=lambda i, _: (0.1 * (i >= 25), 0, 0)))
    page = tmp_path / "drift.html"
    code, out, _ = run("--page", str(page))
    text = page.read_text(encoding="utf-8")
    assert (code, f"Page: {page}" in out) == (1, True)
    assert text.count("<svg") == 5
    assert text.count('class="largest"') >= 3
    # Two limit lines beside each weighted mean, one point for each judged value.
    limits = re.findall(r'<polyline[^>]*points="([^"]*)"[^>]*class="mean-limit"', text)
    limits += re.findall(r'<polyline[^>]*class="mean-limit"[^>]*points="([^"]*)"', text)
    assert len(limits) == 2 * text.count('class="mean"') == 10
    assert {len(one.split()) for one in limits} == {12}
    assert "Tool 1 has moved sideways" in text
    assert "<script" not in text
    assert run("--page", str(page))[0] == 2, "a file that is there stays"
    assert run("--page", str(page), "--force")[0] == 1


# A measurement's statement is read back from its record: journal show, diff, and the report.

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


def recorded(*, sigma_mm=None, drift_mm=0.06, wider_mm=None, damaged=False, claim=CLAIM):
    """Record a change, and return the number of its first entry."""
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
    text = shown("journal", "show", str(recorded()))
    for said in (
        "Repeatable: not known (two touches cannot check each other).",
        "X, Y: accurate to +-0.088 mm (95 %).",
        "Largest row: judging contact by eye, +-0.05 mm (default, not measured).",
        "Seating: mounted anew, the tip lies within +-0.130 mm of here (95 %, 12 changes).",
        "judging contact by eye +-0.05 mm default, not measured",
    ):
        assert said in text
    assert "not assessed" not in text
    assert "accuracy rows" not in text


def test_the_entry_of_a_turn_test_says_what_it_contradicts(shown):
    text = shown("journal", "show", str(recorded(sigma_mm=0.02) + 4))
    assert "Scatter alone explains only 0.0" in text
    assert "it does not repeat as stated" in text


def test_the_entry_and_the_page_say_what_the_turn_test_would_not_show(shown, tmp_path):
    page, said = tmp_path / "page.html", "less than 0.022 mm (X, Y) may not show."
    recorded(sigma_mm=0.02, drift_mm=0.004, claim=replace(CLAIM, accurate_mm=0.02))
    assert said in shown("journal", "show", "5")
    (tool,) = shown("journal", "report", "c0ffee", str(page), "--json")["tools"]
    assert tool["verification"]["judgement"]["shows_from_mm"] == pytest.approx(0.0222, abs=1e-4)
    assert said in page.read_text(encoding="utf-8")
    less = recorded(sigma_mm=0.02, drift_mm=0.004)
    assert "may not show" not in shown("journal", "show", str(less + 4))


def test_a_damaged_statement_is_shown_as_it_stands(shown):
    text = shown("journal", "show", str(recorded(damaged=True)))
    assert "accuracy rows: torn" in text


def test_two_changes_differ_in_what_they_are_repeatable_and_accurate_to(shown):
    first, second = recorded(), recorded(sigma_mm=0.02)
    fields = shown("journal", "diff", str(first), str(second), "--json")["fields"]
    differing = {field["name"]: (field["a"], field["b"]) for field in fields}
    assert differing["repeatable_to_mm"] == ("", "0.035")
    assert differing["accurate_to_mm"] == ("0.088", "0.079")


def test_a_report_has_the_statement_that_stands_and_is_no_proof_with_a_doubt(shown, tmp_path):
    recorded(sigma_mm=0.02, wider_mm=0.15)
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
    assert "accurate to, 95 %" not in text  # that of each axis alone is no longer there
    assert "The tool conforms" not in text


def test_a_drift_that_the_accuracy_covers_is_a_doubt_on_the_page(shown, tmp_path):
    recorded(sigma_mm=0.02, drift_mm=0.02)
    page = tmp_path / "page.html"
    shown("journal", "report", "c0ffee", str(page), "--json")
    text = page.read_text(encoding="utf-8")
    assert "Within its limit, with a doubt" in text
    assert "Written and read back; the turn test leaves a doubt" in text


def test_a_report_of_a_good_change_conforms(shown, tmp_path):
    recorded(sigma_mm=0.02, drift_mm=0.004)
    page = tmp_path / "page.html"
    shown("journal", "report", "c0ffee", str(page), "--json")
    text = page.read_text(encoding="utf-8")
    assert "Written, read back and tested" in text
    assert "It agrees with the stated accuracy" in text
    assert "X, Y: accurate to ± 0.079 mm (95 %)." in text
    assert "accurate to, 95 %" in text
    assert "not on record</td>" not in text


def test_a_table_for_a_spreadsheet_has_both_figures(shown, tmp_path):
    recorded(sigma_mm=0.02, wider_mm=0.15)
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
