"""What comes from a simulator says so on every page, and nothing is called real."""

import pytest

from robolink import connect
from robolink.drift import CellDrift, MeasuredChange, measured_changes
from robolink.journal import memory_journal
from robolink.model import (
    ControllerFacts,
    EntryKind,
    NewEntry,
    is_simulated_name,
    says_it_is_simulated,
)
from robolink.report import render, render_drift, reports_of
from robolink.testing import MemoryController

BAND, VERDICT = "SIMULATED: these results come from a simulator", "Simulated: "
OFFSET = [12.3, -3.9, -20.0, 0.0, 0.0, 0.0]
MADE: dict[str, str] = {"made_at": "2026-11-23T08:00:00Z", "robolink_version": "1.2.3"}
REAL, SIMULATED = "epson:F1A000123/F1A0001", "epson:C-SIM0A1B2C3D/SIM0A1B2C3D"


def body_of(page):
    return page.partition("</style>")[2]


def changed(controller, **said):
    """Return the entries of a measured and kept change."""
    journal = memory_journal(f"pages-{controller}-{sorted(said)}")
    log = journal.log(controller)
    log.change = "c-1"
    details = {"before": OFFSET, "proposed": OFFSET, "method": "n-angle", "measured": ["x_mm"]}
    log.append(
        NewEntry(EntryKind.CALIBRATION, tool=1, details={**details, **said}),
        NewEntry(EntryKind.DONE, tool=1, details={"value": OFFSET}),
    )
    return list(journal.entries(newest_first=False))


CASES: dict[str, tuple[str, dict[str, object], bool]] = {
    "its name": (SIMULATED, {}, True),
    "its URL": ("epson+sim://cell", {}, True),
    "its facts, in an entry of before": (
        "epson@127.0.0.1:5000",
        {"facts": {"robot_serials": ["SIM0A1B2C3D"]}},
        True,
    ),
    "its mailbox": ("softmotion:0A1B2C3D", {"simulated": True}, True),
    "nothing": (REAL, {}, False),
    "nothing of a PLC": ("softmotion:0A1B2C3D", {}, False),
}


@pytest.mark.parametrize("name", CASES)
def test_the_page_of_a_recorded_change_carries_a_band_and_the_verdict_says_it(name):
    controller, said, simulated = CASES[name]
    (report,) = reports_of(changed(controller, **said), check="", **MADE)
    page = body_of(render(report))
    assert (BAND in page, VERDICT in page) == (simulated, simulated)
    assert simulated or "imulated" not in page


@pytest.mark.parametrize("name", ["its mailbox", "nothing of a PLC"])
def test_the_drift_page_likewise_and_is_headed_by_the_cell(name):
    controller, said, simulated = CASES[name]
    changes = tuple(measured_changes(changed(controller, **said), lambda _: True))
    page = body_of(render_drift([CellDrift(controller, changes, (), ())], **MADE))
    assert (BAND in page, VERDICT in page) == (simulated, simulated)
    assert f"<h1>Tool offsets over time: {controller}</h1>" in page


def test_the_drift_page_knows_a_simulator_by_its_name_too():
    change = MeasuredChange(7, "2026-11-22", "c-1", 1, "", "", {"x": 1.0}, None, None)
    page = render_drift([CellDrift(SIMULATED, (change,), (), ())], **MADE)
    assert BAND in page


@pytest.mark.simulator_only
@pytest.mark.parametrize("kind", ["epson", "softmotion"])
def test_a_simulator_says_what_it_is_and_a_controller_that_says_nothing_is_not_one(kind):
    with connect(f"{kind}+sim://says-{kind}") as controller:
        assert says_it_is_simulated(controller)
    assert not says_it_is_simulated(MemoryController(), ControllerFacts(controller_serial="SIM1"))
    assert not is_simulated_name("epson:SIMATIC/SIMPLE01")
