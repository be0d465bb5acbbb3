"""Every page marks simulated data, and nothing simulated is called real."""

import contextlib
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.plc.serving import serve_plc

from robolink import ToolOffset, connect
from robolink.controllers import SimpleController, open_plc_map
from robolink.drift import CellDrift, MeasuredChange, measured_changes
from robolink.errors import ConfigError
from robolink.journal import memory_journal
from robolink.model import (
    ControllerFacts,
    EntryKind,
    NewEntry,
    is_simulated_name,
    says_it_is_simulated,
)
from robolink.register_maps import load_map
from robolink.report import render, render_drift, reports_of
from robolink.testing import confirm_whole_map
from robolink.transaction import Wanted, change_tools
from robolink.transport import parse_url
from tests._rows import each_row

MAP = Path("examples/plc-maps/no-handshake.toml")
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


@each_row("name", CASES)
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
    assert not says_it_is_simulated(SimpleController(), ControllerFacts(controller_serial="SIM1"))
    assert not is_simulated_name("epson:SIMATIC/SIMPLE01")


@pytest.fixture(params=["softmotion", "plc", "plc of another address"])
def changed_by_hand(request):
    """Return the entries after a value was typed, and whether they are simulated."""
    kind = request.param
    log = memory_journal(f"typed-{kind}").log(f"typed-{kind}")
    with contextlib.ExitStack() as open_things:
        url = "softmotion+sim://typed-example"
        if kind != "softmotion":
            plc = PlcSimulator(load_map(MAP), seed=7)
            url = open_things.enter_context(serve_plc(plc, MAP)).url
            if kind != "plc":
                url = url.replace("&simulated=yes", "")
        controller = open_things.enter_context(connect(url, outcomes=log))
        if kind != "softmotion":
            confirm_whole_map(controller)
        assert says_it_is_simulated(controller) is (kind != "plc of another address")
        old = controller.tools.read(1)
        change_tools(controller, [Wanted(1, replace(old or ToolOffset(), x_mm=12.5), old)])
        return list(log.recorded())[::-1], kind != "plc of another address"


@pytest.mark.simulator_only
def test_a_typed_value_on_a_simulated_controller_has_a_band_too(changed_by_hand):
    entries, simulated = changed_by_hand
    entries = [entry for entry in entries if entry.change]
    (report,) = reports_of(entries, check="", **MADE)
    page = body_of(render(report))
    assert (BAND in page, VERDICT in page) == (simulated, simulated)


@each_row(
    "address",
    [
        "plc+modbus-tcp://192.168.0.2?map={map}&simulated=yes",
        "plc+modbus-tcp://plc-07?map={map}&simulated=yes",
        "plc+modbus-tcp://0.0.0.0?map={map}&simulated=yes",
        "plc+modbus-rtu:///dev/ttyUSB0?map={map}&simulated=yes",
        "plc+modbus-rtu:///dev/ttyS1?map={map}&simulated=yes",
        "plc+modbus-rtu://COM3?map={map}&simulated=yes",
        "plc+modbus-tcp://127.0.0.1?map={map}&simulated=no",
    ],
)
def test_the_sign_of_a_simulator_is_refused_where_a_machine_could_be(address):
    with pytest.raises(ConfigError, match="only for a simulator on this computer"):
        open_plc_map(parse_url(address.format(map=MAP)), outcomes=lambda name: pytest.fail(name))


@each_row(
    ("address", "here"),
    [
        ("127.0.0.1:502", True),
        ("[::1]:502", True),
        ("localhost", True),
        ("/dev/pts/7", True),
        ("/dev/ttys004", True),
        ("/dev/ttyS0", False),
        ("192.168.0.2", False),
        ("localhost.example.org", False),
    ],
)
def test_what_stays_on_this_computer(address, here):
    assert parse_url(f"plc+any://{address}").stays_here is here
