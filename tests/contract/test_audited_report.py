"""The contents that an auditor needs on a calibration's page, on both kinds of controllers."""

import json
import re
from datetime import datetime

import pytest
from robolink_cli.commands.record.report import report_payload

from robolink.model import EntryKind
from robolink.report import reports_of, save
from tests.contract._method_cell import method_cell, on

pytestmark = pytest.mark.simulator_only


@pytest.fixture(params=on("epson"))
def cell(request, tmp_path, monkeypatch):
    with method_cell(request.param, tmp_path, monkeypatch) as cell:
        yield cell


def text_of(path):
    page = path.read_text(encoding="utf-8").partition("</style>")[2]
    return " ".join(re.sub(r"<[^>]*>", " ", page).split())


def test_machine_gauge_people_times_budget_touches_and_rule_stand_on_the_page(cell, tmp_path):
    done = cell.calibrate("n-angle", "--station", "PIN-07", "--count", "6")
    assert done.code == 0, done.err
    assert "gauge G-123 at station PIN-07 ran out on 2020-01-31" in done.err
    change = cell.recorded(EntryKind.CALIBRATION)[0].change
    entries = [entry for entry in cell.recorded() if entry.change == change][::-1]
    reports = reports_of(entries, made_at="2026-03-04", robolink_version="1.2.3", check="Checked.")
    page = tmp_path / "page.html"
    save(reports[0], page)
    (tool,) = json.loads(json.dumps(report_payload(reports, page)))["tools"]
    assert tool["gauges"] == [
        {"id": "G-123", "station": "PIN-07", "due": "2020-01-31", "overdue": True}
    ]
    assert datetime.fromisoformat(tool["local_time"]).utcoffset() is not None
    assert tool["budget"]["u_c_mm"] > 0
    assert tool["region95_radius_mm"] > max(tool["half_width95"].values())
    assert tool["repeatable_to_mm"] == tool["region95_radius_mm"] < tool["accurate_to_mm"]
    assert tool["accuracy"]["largest_row"] == "touch_mm"
    assert tool["verification"]["passed"]
    assert any(tool["machine"].values())
    text = text_of(page)
    for words in (
        "gauge G-123, station PIN-07, calibration due 2020-01-31, OVERDUE",
        "time (UTC)",
        "local time",
        "done by",
        "Measured before after change repeatable to, 95 % accurate to, 95 % X mm",
        "Kept, not measured",
        "Each interval of the table holds for its axis alone",
        "X, Y: repeatable to ± 0.0",
        "X, Y: accurate to ± 0.0",
        "Largest row: judging contact by eye, ± 0.05 mm (default, not measured)",
        "Seating: not known",
        "degrees of freedom",
        "combined",
        "Test for a step: F",
        "How the touches were made",
        "1 jogged by the person",
        "Decision rule (after ISO 14253-1)",
        "The tool conforms",
    ):
        assert words in text
    assert "+-" not in text
    assert "not assessed" not in text
    assert text.count("undecided") == 1  # only in the rule
