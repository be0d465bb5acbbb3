"""A cell with a PLC under a finger: a whole change, a STOP, and its release on the page."""

import time

import pytest
from robolink_simulators.softmotion.group.condition import SmcGroupState

from robolink.stopping import find_note
from robolink.transport import far_end_of
from tests.panel.browser.person import Person, pictured
from tests.panel.browser.real_cell import RealCell
from tests.panel.browser.scripted import until

pytestmark = pytest.mark.timeout(240)


@pytest.fixture
def cell(tmp_path, monkeypatch, chromium):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    with RealCell(tmp_path, plc=True) as made:
        yield made


def state(cell):
    return cell.simulator.plc.group.state


def test_a_whole_change_then_a_stop_that_is_released_on_the_page(cell, tablet):
    cell.mount(0.31, -0.22)
    page = tablet.new_page()
    person = Person(page, cell)
    person.opens()
    person.begins()
    person.change(at_touch=lambda: pictured(page, "plc-touch"))
    pictured(page, "plc-end")
    assert "DONE" in page.inner_text("#main .ended.ok")
    pictured(page, "plc-done")
    time.sleep(0.4)  # longer than a press is ignored for
    person.tap("[data-action=finish]")
    page.wait_for_selector('.row[data-post="/start"]')

    person.fingers.down("#stop")
    page.wait_for_selector("#stopped:visible")
    person.fingers.up()
    assert state(cell) is SmcGroupState.STOPPING
    page.evaluate("document.getElementById('stopped').hidden = true")
    release = '.row[data-post="/start"][data-body*="release"]:not([aria-disabled])'
    page.wait_for_selector(release, timeout=30_000)
    pictured(page, "plc-stopped")
    time.sleep(0.4)
    person.tap(release)
    page.wait_for_selector("[data-action=yes]:not([aria-disabled])", timeout=30_000)
    assert "holds the axis group" in page.inner_text("#main")
    assert state(cell) is SmcGroupState.STOPPING
    pictured(page, "plc-release")
    time.sleep(0.4)
    person.tap("[data-action=yes]")
    page.wait_for_selector("body[data-screen=end] .ended.ok", timeout=30_000)
    page.wait_for_selector("header .state:has-text('ready')")
    pictured(page, "plc-released")
    assert state(cell) is SmcGroupState.STANDBY
    time.sleep(0.4)
    person.tap("[data-action=finish]")
    page.wait_for_selector('.row[data-post="/start"]')
    until(lambda: not page.locator(release).count(), 30)
    url = next(
        line for line in (cell.folder / "cell.toml").read_text().splitlines() if "url" in line
    )
    assert find_note(far_end_of(url.split('"')[1])) is None
