"""report: a page about a change from the journal alone, however the change ended."""

import json
import re
import sqlite3

import pytest
from robolink_cli import main
from robolink_cli.access.change_page import page_of_change
from robolink_simulators.epson.memory.points import Point

from robolink.calibration import Drift, VerifyResult
from robolink.calibration_run._records import verification_entry
from robolink.errors import ConfigError
from robolink.journal import open_journal
from robolink.model import (
    AnsweredBy,
    EntryKind,
    NewEntry,
    Pose,
    Signature,
    ToolOffset,
    answer_entry,
)

ELSEWHERE = "epson+tcp://192.168.0.9:5000"
OLD, NEW = [12.0, -3.5, -20.0, 0.0, 0.0, 0.0], [12.3, -3.7, -20.0, 0.0, 0.0, 0.0]
VALUES = {"before": OLD, "requested": NEW}
ANN = Signature(
    operator="Ann",
    role="engineer",
    os_user="cell",
    host="pc-5",
    nozzle="N-0815",
    lot="L-7",
    recipe="tip.toml",
    recipe_hash="ab" * 32,
    station="pin-2",
)
CALIBRATION = NewEntry(
    EntryKind.CALIBRATION,
    tool=1,
    tolerance="change up to 2 mm",
    verdict="measured: X 12.300",
    details={
        "source": "one pin touched",
        "before": OLD,
        "proposed": NEW,
        "method": "two_pose",  # an entry of before
        "measured": ["x_mm", "y_mm"],
        "poses": [{"x_mm": 153.217, "y_mm": 501.272, "z_mm": -83.5, "u_deg": 0, "hand": "right"}],
        "residuals_mm": [[0.03, 0.04]],
        "rms_mm": 0.05,
        "max_residual_mm": 0.05,
        "notes": ["A person typed Z."],
        "warnings": ["small_rotation", "odd_thing"],
    },
)
PASSED = verification_entry(1, VerifyResult((Drift(90, 0.02, -0.01),), 0.2))
FAILED = verification_entry(1, VerifyResult((Drift(90, 0.5, 0.0),), 0.2))


def entry(kind, verdict="", **details):
    return NewEntry(kind, tool=1, verdict=verdict, details=details)


WRITTEN = (
    entry(EntryKind.INTENT, **VALUES),
    entry(EntryKind.WRITE, request="TLSet 1"),
    entry(EntryKind.READ_BACK, **VALUES, value=NEW),
)
DONE = entry(EntryKind.DONE, "verified", **VALUES, value=NEW)
DECLINED = NewEntry(EntryKind.DECISION, verdict="declined", details={"accepted": False})
REFUSED = entry(
    EntryKind.REFUSED,
    "The poses lie too close.",
    code="too_few_poses",
    poses=[{"x_mm": 1.25, "y_mm": 2, "z_mm": 3, "u_deg": 4}],
)
BACK = entry(EntryKind.ROLLED_BACK, "The old value was written back.", **VALUES, value=OLD)

ENDS = {
    "verified": ((CALIBRATION, *WRITTEN, PASSED, DONE), "Written, read back and tested"),
    "written": ((*WRITTEN, DONE), "Written and read back, not tested"),
    "skipped": ((CALIBRATION, DONE), "Stored already, nothing was written"),
    "proposed": ((CALIBRATION,), "A proposal, nothing was written"),
    "declined": ((CALIBRATION, DECLINED), "Declined, nothing was written"),
    "refused at once": ((REFUSED,), "Refused, nothing was written"),
    "refused, then measured": ((REFUSED, CALIBRATION), "A proposal, nothing was written"),
    "drifts": ((CALIBRATION, *WRITTEN, FAILED, BACK), "The turn test failed"),
    "taken back": ((*WRITTEN, BACK), "Undone, the tool has its old value again"),
    "not applied": (
        (WRITTEN[0], entry(EntryKind.NOT_APPLIED, **VALUES, value=OLD)),
        "Not applied, the tool keeps its old value",
    ),
    "conflict": (
        (*WRITTEN, entry(EntryKind.CONFLICT, **VALUES, value=[9.0] * 6)),
        "Conflict: the tool holds neither",
    ),
    "killed": ((CALIBRATION, WRITTEN[0]), "The record does not say how the write ended."),
}


@pytest.fixture
def recorded(simulator):
    """Record a change; return its id."""

    def record(*entries, change="c0ffee00" * 4, controller=simulator.url):
        log = open_journal().log(controller, signature=ANN)
        log.change = change
        log.append(*entries)
        return change

    return record


def text_of(path):
    page = path.read_text(encoding="utf-8")
    assert not re.search(r"<script|url\(|https?://", page)
    return " ".join(re.sub(r"<[^>]*>", " ", page.partition("</style>")[2]).split())


@pytest.mark.parametrize("name", ENDS)
def test_how_it_ended_stands_on_the_page(run, recorded, tmp_path, name):
    entries, words = ENDS[name]
    recorded(*entries)
    assert run("report", "1", "page.html")[0] == 0
    assert words in text_of(tmp_path / "page.html")


def test_the_page_that_the_wizard_shows_is_that_of_the_command(run, recorded, tmp_path):
    change = recorded(*ENDS["verified"][0])
    recorded(*ENDS["declined"][0], change="decade00" * 4)
    assert run("report", change[:8], "page.html")[0] == 0
    (said,) = page_of_change(change)
    page = tmp_path / f"change-{change[:8]}.html"
    assert said == f"Report: {page}"
    made = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?")
    assert made.sub("", text_of(page)) == made.sub("", text_of(tmp_path / "page.html"))
    # An existing file is not overwritten, and an unknown change has no page.
    page.write_text("mine")
    beside = page.with_stem(f"{page.stem}-2")
    assert page_of_change(change) == (f"Report: {beside}",)
    assert page.read_text() == "mine"
    with pytest.raises(ConfigError):
        page_of_change("facade00" * 4)
    assert {*tmp_path.glob("change-*")} == {page, beside}


def test_the_page_says_who_when_with_what_and_what_came_of_it(run, recorded, simulator, tmp_path):
    change = recorded(REFUSED, *ENDS["verified"][0])
    code, out, _ = run("report", change[:4], "page.html", "--json")
    document = json.loads(out)
    assert (code, document["change"], document["problems"]) == (0, change, [])
    (tool,) = document["tools"]
    assert (tool["tool"], tool["outcome"], tool["method"]) == (1, "verified", "two-pose")
    assert tool["measured"] == ["x_mm", "y_mm"]
    assert tool["local_time"] is None  # an earlier entry lacks it
    text = text_of(tmp_path / "page.html")
    for words in (
        f"controller {simulator.url}",
        f"report number {change}",
        "Ann (engineer), user cell on pc-5",
        "nozzle, lot N-0815, L-7",
        f"recipe tip.toml, SHA-256 {'ab' * 32}",
        "station pin-2",
        "new offset one pin touched",
        "method two-pose",
        "X mm 12.000 12.300 0.300",
        "Y mm -3.500 -3.700 -0.200",
        "Kept, not measured Z mm U deg V deg W deg before -20.000 0.000",
        "robot not on record",
        "calibration change up to 2 mm measured: X 12.300; rms 0.050 mm",
        "1 153.217 501.272 -83.500 0.000 right 0.030 0.040 0.050",
        "1 1.250 2.000 3.000 4.000",
        "The poses lie too close.",
        "A person typed Z.",
        "half a turn would be best",
        "odd thing",
        "Passed: 0.022 mm off at most, limit 0.200 mm.",
        "All 7 journal entries were checked",
        *(found.hash for found in open_journal().entries()),
    ):
        assert words in text
    assert (tmp_path / "page.html").read_text(encoding="utf-8").count("<svg") == 3


def test_several_tools_stand_on_one_page(run, recorded, tmp_path):
    tools = {str(tool): {"before": OLD, "requested": NEW} for tool in (1, 2)}
    begun = NewEntry(EntryKind.INTENT, details={"tools": tools, "verify": False})
    recorded(begun, *WRITTEN)
    code, out, _ = run("report", "1", "page.html", "--json")
    assert code == 0
    assert [tool["tool"] for tool in json.loads(out)["tools"]] == [1, 2]
    text = text_of(tmp_path / "page.html")
    assert "Tools 1, 2: change of the offsets Simulated: Not finished" in text
    assert text.count("X mm 12.000 12.300 0.300") == 2


def test_without_a_name_the_newest_change_is_meant_and_the_file_is_named_after_it(
    run, recorded, simulator, tmp_path
):
    recorded(*ENDS["verified"][0])
    assert run("tool", "set", "1", "--x", "13", "--yes")[0] == 0
    newest = next(open_journal().entries()).change
    assert run("report")[0] == 0
    assert newest in text_of(tmp_path / f"change-{newest[:8]}.html")
    sent = simulator.exchanges
    assert run("report", "named.html")[0] == 0
    assert simulator.exchanges == sent
    assert newest in text_of(tmp_path / "named.html")


def test_taught_points_are_read_from_the_controller_of_the_change(
    run, recorded, simulator, tmp_path
):
    simulator.machine.points.store(1, Point.at(Pose(250, 200, -30, 0)))
    assert run("tool", "set", "1", "--x", "13", "--yes")[0] == 0
    change = next(open_journal().entries()).change
    assert run("report", change[:6], "page.html", "--points", "1-3")[0] == 0
    text = text_of(tmp_path / "page.html")
    assert "Largest: 1.000 mm, P1." in text
    assert "serial SIM00001" in text


def test_a_change_of_another_controller_is_not_this_cells(run, recorded, tmp_path):
    change = recorded(*ENDS["written"][0], controller=ELSEWHERE)
    for name in ("1", change[:6]):
        code, _, err = run("report", name, "page.html")
        assert (code, "No entry and no change" in err or "neither" in err) == (2, True)
    assert main.run(["report", change[:6], "page.html"]) == 0
    assert ELSEWHERE in text_of(tmp_path / "page.html")


def test_an_undo_says_what_it_undid(run, simulator, tmp_path):
    simulator.machine.tools.set(1, ToolOffset(*OLD))
    assert run("tool", "set", "1", "--x", "13", "--yes")[0] == 0
    assert run("undo", "--yes")[0] == 0
    assert run("report", "page.html")[0] == 0
    assert "new offset undo the change" in text_of(tmp_path / "page.html")


def test_a_journal_that_was_tampered_with_shows_at_the_top(run, recorded, state_folder, tmp_path):
    recorded(*ENDS["verified"][0])
    with sqlite3.connect(state_folder / "journal.db") as database:
        database.execute("update entries set verdict = 'better' where number = 1")
    database.close()
    code, _, err = run("report", "1", "page.html")
    assert code == 1
    assert "Entry 1 was changed after it was stored." in err
    text = text_of(tmp_path / "page.html")
    assert text.index("The journal was CHANGED after it was stored.") < text.index("controller")


def test_a_file_is_replaced_only_with_force(run, recorded, tmp_path):
    recorded(CALIBRATION)
    (tmp_path / "page.html").write_text("mine", encoding="ascii")
    code, _, err = run("report", "1", "page.html")
    assert (code, "exists already" in err) == (2, True)
    assert run("report", "1", "page.html", "--force")[0] == 0
    assert "A proposal" in text_of(tmp_path / "page.html")


def test_a_page_that_nobody_names_is_written_beside_the_one_that_is_there(run, recorded, tmp_path):
    recorded(CALIBRATION)
    for made in (1, 2, 3):
        assert run("report", "1")[0] == 0, "the last screen proposes it again"
        assert len(list(tmp_path.glob("change-*.html"))) == made
    assert run("report", "1", "--force")[0] == 0
    assert len(list(tmp_path.glob("change-*.html"))) == 3


REFUSALS = {
    "about no tool": (DECLINED, "not about a change"),
    "damaged": (NewEntry(EntryKind.VERIFY, tool=1, details={}), "cannot be understood"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_entries_that_make_no_report_are_refused(run, recorded, tmp_path, name):
    entry, words = REFUSALS[name]
    recorded(entry)
    code, _, err = run("report", "1", "page.html")
    assert code == 2
    assert words in err
    assert not (tmp_path / "page.html").exists()


def test_without_any_change_there_is_nothing_to_report(run, simulator):
    open_journal().log(simulator.url).append(DECLINED)
    code, _, err = run("report")
    assert (code, "No tool change is on record" in err) == (2, True)


def test_a_nozzle_that_was_only_noted_is_no_row_and_an_answer_is_called_one(
    run, recorded, tmp_path
):
    noted = NewEntry(EntryKind.DECISION, tool=1, verdict=ANN.nozzle)
    asked = answer_entry("Is the new tip as long?", True, AnsweredBy.PERSON, tool=1)
    recorded(noted, asked, CALIBRATION, *WRITTEN, PASSED, DONE)
    assert run("report", "1", "page.html")[0] == 0
    text = text_of(tmp_path / "page.html")
    assert f"decision - {ANN.nozzle}" not in text
    assert "answer - Is the new tip as long? accepted (asked and answered)" in text
