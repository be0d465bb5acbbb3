"""The history page: rows and charts come from the journal of changes that were really made."""

import shutil
from dataclasses import replace
from typing import Any

import pytest
from robolink_cli.panel import record
from robolink_cli.panel.history import changes_of, charts_of, page_of
from robolink_cli.panel.record import LastChange, standing_of
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.cell.tip_switches import LightBeam
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.testkit.media import served

from robolink.errors import ConfigError
from robolink.journal import close_files, open_journal
from robolink.model import EntryKind, NewEntry, Signature
from tests._commands import run_command
from tests.contract._shipped_cells import BEAMS_MM, EXAMPLES

URL = "epson+tcp://192.168.0.9:5000"


@pytest.fixture(scope="module")
def two_changes(tmp_path_factory):
    """Change a nozzle twice in a cell with two beams; return the state folder and the URL."""
    folder = tmp_path_factory.mktemp("state")
    simulator = EpsonSimulator(seed=3)
    simulator.machine.motors_on = True
    simulator.world.change_nozzle(2)
    for number, heading_deg in ((3, 2.0), (4, 91.0)):
        beam = LightBeam(BEAMS_MM, heading_deg, radius_mm=0.1)
        simulator.world.connect(number, beam, latency_s=0.002, noise_mm=0.003)
    with (
        pytest.MonkeyPatch.context() as patch,
        served(simulator, "tcp", clock=ScaledClock(40)) as url,
    ):
        patch.setenv("ROBOLINK_STATE_DIR", str(folder))
        for nozzle in ("N-1", "N-2"):
            words = ("--nozzle", nozzle, "--lot", "L", "--yes")
            done = run_command("-c", url, "change", str(EXAMPLES / "needle-beams.toml"), *words)
            assert done.code == 0, done.err
    close_files()
    return folder, url


@pytest.fixture
def changed(two_changes, robolink_state):
    """Both changes in this test's own state folder; returns the URL of the cell."""
    folder, url = two_changes
    shutil.copytree(folder, robolink_state, dirs_exist_ok=True)
    return url


def test_two_changes_are_rows_charts_and_pages_of_this_cell(changed):
    newest, first = changes_of(changed)
    assert ("N-2" in newest.what, "N-1" in first.what) == (True, True)
    assert (newest.mark, newest.report) == ("ok", True)
    assert 0.0 < float(newest.tested) < 0.2
    assert float(first.moved) > float(newest.moved)  # the second needle is the first one

    assert newest.change in page_of(changed, newest.change)
    with pytest.raises(ConfigError):
        page_of(URL, newest.change)

    cards = charts_of(changed)
    assert {card.title for card in cards} >= {"X of tool 1", "Y of tool 1"}
    assert all(card.picture.startswith("<svg") and not card.unusual for card in cards)
    assert charts_of(changed, striking=True) == ()


def last_of(found) -> LastChange:
    last: LastChange | None = found.last
    assert last is not None
    return last


def test_a_card_tells_the_last_change_and_works_the_drift_out_once(changed, monkeypatch):
    found = standing_of(changed)
    assert (last_of(found).tool, last_of(found).needle, found.simulated) == (1, "N-2", True)
    assert found.unusual is None, "two changes do not tell whether one is unusual"
    assert "tool 1, needle N-2" in " ".join(found.past())

    def again(*_):
        raise AssertionError("the drift was worked out again though nothing is new")

    monkeypatch.setattr(record, "cell_drift", again)
    assert standing_of(changed, found) == found
    seen = open_journal().log(changed, signature=Signature(operator="Chen", os_user="cell"))
    seen.append(NewEntry(EntryKind.PANEL, details={"kind": "login"}))
    assert standing_of(changed, found) == found, "a login is no change"


def test_a_card_tells_no_change_that_was_taken_back(robolink_state, monkeypatch):
    def ended(change, needle, *kinds):
        signature = Signature(operator="Chen", os_user="cell", nozzle=needle)
        log = open_journal().log(URL, signature=signature)
        for kind in kinds:
            log.append(NewEntry(kind, change=change * 32, operation=change, tool=2))

    ended("a", "N-1", EntryKind.DONE)
    ended("b", "N-2", EntryKind.DONE, EntryKind.ROLLED_BACK)
    found = standing_of(URL)
    assert (last_of(found).who, last_of(found).needle) == ("Chen", "N-1")
    assert not found.simulated

    ended("c", "N-3", EntryKind.DONE)
    assert last_of(standing_of(URL, found)).needle == "N-3", (
        "what was found before outlived a change"
    )


def test_a_stop_that_was_released_is_not_told_from_what_was_found_before(changed):
    before = standing_of(changed)
    held: Any = {"interrupted": ("open",), "stopped": "stopped"}
    found = standing_of(changed, replace(before, **held))
    assert (found.interrupted, found.stopped) == ((), None)


def test_without_a_journal_there_is_nothing(robolink_state):
    assert (changes_of(URL), charts_of(URL)) == ((), ())


def test_a_change_that_cannot_be_understood_is_a_row_without_a_page(robolink_state):
    log = open_journal().log(URL, signature=Signature(operator="Chen", os_user="cell"))
    log.append(
        NewEntry(EntryKind.CALIBRATION, change="c" * 32, operation="o", tool=1, details={"x": 1})
    )
    (row,) = changes_of(URL)
    assert (row.who, row.mark, row.report) == ("Chen", "bad", False)
