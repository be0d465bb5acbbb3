"""The fixtures of the pytest plugin, as an integrator's tests use them."""

import os
import subprocess
import sys
from contextlib import ExitStack
from xml.etree import ElementTree

import pytest
from robolink_simulators import pytest_plugin
from robolink_simulators.device.wire_record import MOST_LINES, WireRecord
from robolink_simulators.testkit.making import CellRequest, make_epson, make_softmotion
from robolink_simulators.testkit.served import OwnFolder

import robolink
from robolink import ToolOffset
from robolink.errors import (
    ConfigError,
    OutcomeUnknownError,
    RobolinkError,
    TransportBrokenError,
)
from robolink.journal import forget_memory, memory_journal
from robolink.model import EntryKind
from robolink.protocols.mailbox.exports import program_texts
from robolink.testing import confirm_whole_map
from robolink.transaction import Wanted, change_tools
from robolink.transport import parse_url

WANTED = ToolOffset(1.0, 2.0, -30.0)


def write(cell, tool=2, wanted=WANTED):
    with robolink.connect(cell.url) as controller:
        controller.tools.write(tool, wanted, expected=robolink.ANY)


@pytest.mark.parametrize("medium", ["tcp", "serial"])
def test_an_epson_is_served_on_each_medium(epson_factory, medium):
    cell = epson_factory(medium=medium)
    write(cell)
    assert cell.truth()["stored"]["2"]["z_mm"] == WANTED.z_mm
    cell.wire.assert_sent("TLSet 2, XY", times=1)
    cell.motions.assert_none()


@pytest.mark.parametrize(
    "softmotion_sim", ["sim", "modbus-tcp", "modbus-rtu", "can"], indirect=True
)
def test_a_plc_is_served_on_each_bus(softmotion_sim):
    write(softmotion_sim)
    assert softmotion_sim.truth()["stored"]["2"]["z_mm"] == pytest.approx(WANTED.z_mm)
    softmotion_sim.wire.assert_sent("WRITE_TOOL", times=1)
    softmotion_sim.motions.assert_none()


@pytest.mark.parametrize("softmotion_sim", ["sim", "modbus-rtu", "can"], indirect=True)
def test_the_cable_of_a_plc_is_pulled_where_a_connection_ends_with_it(softmotion_sim):
    with robolink.connect(softmotion_sim.url) as controller:
        if softmotion_sim.url.startswith("softmotion+sim"):
            softmotion_sim.do("cut_link")
            with pytest.raises(TransportBrokenError):
                controller.status()
        else:
            with pytest.raises(ConfigError, match="no connection that could be cut"):
                softmotion_sim.do("cut_link")
            controller.status()


@pytest.mark.parametrize("plc_sim", ["sim", "modbus-tcp", "modbus-rtu"], indirect=True)
def test_a_plc_with_a_map_is_served_in_the_process_and_on_both_buses(plc_sim):
    with robolink.connect(plc_sim.url) as controller:
        confirm_whole_map(controller)
    plc_sim.operator.when("fc16 110", "withdraw_permit")
    write(plc_sim)
    assert plc_sim.truth()["stored"]["2"]["z_mm"] == WANTED.z_mm
    assert plc_sim.operator.done == [("fc16 110", "withdraw_permit")]
    with pytest.raises(RobolinkError, match="permit"):
        write(plc_sim, wanted=ToolOffset(9, 9, 9))
    plc_sim.put_back()
    assert plc_sim.truth()["stored"]["2"]["z_mm"] != WANTED.z_mm


@pytest.mark.robolink(robot="C8-C901S", seed=9, options={"status_flags": 10}, true_tool=(1, 2, 130))
@pytest.mark.robolink(seed=5, world={"eye_sigma_mm": 0.25})
def test_the_marker_says_how_the_cell_is(epson_sim, epson_factory):
    simulator = epson_sim.simulator
    # The marker nearest to the test wins.
    assert (simulator.machine.model.name, simulator.seed) == ("C8-C901S", 5)
    assert simulator.options.status_flags == 10
    assert simulator.world.parameters.eye_sigma_mm == 0.25
    assert epson_sim.truth()["tips"]["1"]["z_mm"] == 130
    other = epson_factory(robot="GX4-C351S", seed=2)
    assert other.simulator.machine.model.name == "GX4-C351S"
    assert other.url != epson_sim.url


@pytest.mark.robolink(kinematics="Kin_Gantry3", faults=[{"action": "drop_reply", "match": "WRITE"}])
def test_the_marker_says_what_goes_wrong(softmotion_sim, fault_plan):
    with pytest.raises(OutcomeUnknownError):
        write(softmotion_sim)
    told = fault_plan(softmotion_sim)
    assert [fault["action"] for fault in told["fired"]] == ["drop_reply"]
    assert told["pending"] == []
    assert softmotion_sim.truth()["stored"]["2"]["z_mm"] == pytest.approx(WANTED.z_mm)


@pytest.mark.robolink(password="s3cret-word")
def test_a_password_is_needed_and_shown_nowhere(epson_sim):
    with pytest.raises(RobolinkError), robolink.connect(epson_sim.url):
        pass
    assert "s3cret-word" not in epson_sim.wire.shown()


@pytest.fixture
def program(tmp_path, request):
    """A folder with an exported program, for one arm or for any."""
    kinematics = getattr(request, "param", "Kin_Gantry3")
    for name, text in program_texts(kinematics=kinematics).items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_a_program_is_executed_behind_the_mailbox_and_is_not_put_back(program, softmotion_factory):
    cell = softmotion_factory(kinematics="Kin_Gantry3", program=program)
    assert cell.simulator.plc.memory.slot(1).name == "nozzle"  # from the program's own variables
    assert cell.simulator.executes_program
    cell.snapshot("now")
    for back in (cell.put_back, lambda: cell.restore("now"), lambda: cell.do("reset")):
        with pytest.raises(ConfigError, match="executes a program cannot be rebuilt"):
            back()


def test_a_program_that_does_not_fit_is_refused(program, softmotion_factory, request):
    with pytest.raises(ConfigError, match=r"line \d+.*Kin_Gantry3"):
        softmotion_factory(program=str(program))  # exported for another arm
    with pytest.raises(ConfigError, match=r"RL_Kept\.st cannot be read"):
        (program / "RL_Kept.st").unlink()
        softmotion_factory(program=program)
    for kind in ("epson", "plc"):
        with pytest.raises(ConfigError, match="uses 'program'"):
            request.getfixturevalue(f"{kind}_factory")(program=program)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"robots": "C8"}, "has no parameter 'robots'"),
        ({"true_tool": (1, 2)}, r"true_tool .* cannot be \(1, 2\)"),
        ({"true_tool": 5}, "true_tool .* cannot be 5"),
        ({"seed": "3"}, "seed .* cannot be '3'"),
        ({"seed": -1}, "seed .* cannot be -1"),
        ({"seed": True}, "seed .* cannot be True"),
        ({"speed": "fast"}, "speed .* cannot be 'fast'"),
        ({"speed": 1001}, "speed .* cannot be 1001"),
        ({"speed": float("nan")}, "speed .* cannot be nan"),
        ({"password": 7}, "password .* cannot be 7"),
        ({"options": "terminator=cr"}, "options .* cannot be 'terminator=cr'"),
        ({"world": [1]}, "world .* cannot be"),
        ({"faults": {"action": "drop_reply"}}, "faults .* cannot be"),
        ({"robot": None}, "robot .* cannot be None"),
        ({"map": 3}, "map .* cannot be 3"),
    ],
)
def test_what_cannot_be_asked_for_is_refused(given, words, epson_factory):
    with pytest.raises(ConfigError, match=words):
        CellRequest.of(given)
    with pytest.raises(ConfigError, match=words):
        epson_factory(**given)
    with pytest.raises(ConfigError, match="cannot be served over 'carrier pigeon'"):
        epson_factory(medium="carrier pigeon")


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [
        ("epson", "kinematics", "Kin_5Axes"),
        ("epson", "map", "machine.toml"),
        ("softmotion", "robot", "C8-C901S"),
        ("softmotion", "password", "a"),
        ("plc", "world", {}),
        ("plc", "true_tool", (1, 2, 3)),
        ("plc", "options", {}),
    ],
)
def test_what_a_kind_pays_no_heed_to_is_refused(kind, name, value, request):
    with pytest.raises(ConfigError, match=f"kind \\({kind}\\) uses '{name}'"):
        request.getfixturevalue(f"{kind}_factory")(**{name: value})


def test_a_seed_below_zero_would_be_another_one_again():
    assert pytest_plugin._seed("7") == 7
    with pytest.raises(ValueError, match="-3"):
        pytest_plugin._seed("-3")


def test_a_speed_is_for_cells_on_a_port(epson_factory, softmotion_factory):
    for make in (epson_factory, softmotion_factory):
        with pytest.raises(ConfigError, match="only while somebody waits"):
            make(speed=5)


def test_a_long_wire_is_counted_whole(epson_sim):
    write(epson_sim)
    record = epson_sim.simulator.log
    for _ in range(MOST_LINES):
        record.add(0, ">", "$GetStatus")
    epson_sim.wire.assert_sent("TLSet 2, XY", times=1)
    with pytest.raises(AssertionError, match="was sent 1 times"):
        epson_sim.wire.assert_not_sent("TLSet 2, XY")
    # A log that has lost a line cannot show how often something was sent.
    epson_sim.simulator.log = short = WireRecord(2)
    for text in ("$Reset", "$GetStatus", "$GetStatus"):
        short.add(0, ">", text)
    for asked in (epson_sim.wire.assert_not_sent, epson_sim.wire.assert_sent):
        with pytest.raises(AssertionError, match="Only the last 2 lines"):
            asked("$Reset")
    assert epson_sim.wire.requests == ("$GetStatus", "$GetStatus")


def test_time_stands_still_until_somebody_steps_it(virtual_clock, epson_sim, softmotion_sim):
    assert virtual_clock.now_ns() == 0
    virtual_clock.advance(3.0)
    for passed_s, cell in ((3.0, epson_sim), (4.0, softmotion_sim)):
        assert cell.do("clock")["simulated_s"] == pytest.approx(passed_s)
        cell.do("step", seconds=1.0)
    assert virtual_clock.now_ns() == 5_000_000_000


def test_a_person_does_what_the_script_says_when_the_wire_gives_the_cue(epson_sim):
    epson_sim.operator.when("GetStatus", "press_estop", skip=1)
    with robolink.connect(epson_sim.url) as controller:
        first, second = controller.status(), controller.status()
    assert (first.emergency_stop, second.emergency_stop) == (False, True)
    assert [act for _, act in epson_sim.operator.done] == ["press_estop"]
    assert epson_sim.operator.waiting == 0
    with pytest.raises(ConfigError, match="cannot do 'dance'"):
        epson_sim.operator.when("GetStatus", "dance")
    with pytest.raises(ConfigError, match="needs number"):
        epson_sim.operator.when("GetStatus", "raise_error")
    for skip in (-1, 0.5, True):
        with pytest.raises(ConfigError, match=r"skip .* cannot be"):
            epson_sim.operator.when("GetStatus", "press_estop", skip=skip)
    epson_sim.operator.when("GetStatus", "restore", name="nothing")
    with robolink.connect(epson_sim.url) as controller:
        controller.status()
    assert [act for act, _ in epson_sim.operator.failed] == ["restore"]
    epson_sim.operator.forget()  # or the test fails because of it
    assert epson_sim.operator.unplayed() == []


@pytest.mark.parametrize("softmotion_sim", ["sim", "can"], indirect=True)
def test_no_command_is_run_on_a_cell_that_it_would_not_reach(epson_sim, softmotion_sim):
    """The command's process would create a simulator of that name and write to that one instead."""
    for cell in (epson_sim, softmotion_sim):
        with pytest.raises(ConfigError, match=r"lives in the process of the test.*epson_cell"):
            cell.run("status")


def test_nobody_is_asked_where_there_is_no_person(epson_factory):
    with pytest.raises(ConfigError, match=r"no person at this cell.*person=True"):
        _ = epson_factory(medium="tcp").by_hand


def test_what_crossed_the_wire_and_what_moved_is_asserted(epson_sim):
    write(epson_sim)
    epson_sim.wire.assert_not_sent("TLSet 3,")
    epson_sim.wire.assert_sent("TLSet 3,", times=0)
    with pytest.raises(AssertionError, match="was sent 1 times, not 0 times"):
        epson_sim.wire.assert_sent("TLSet 2, XY", times=0)
    with pytest.raises(AssertionError, match="'TLSet 3,' was sent 0 times"):
        epson_sim.wire.assert_sent("TLSet 3,")
    with pytest.raises(AssertionError, match="1 times, not 2 times") as told:
        epson_sim.wire.assert_sent("TLSet 2, XY", times=2)
    assert '$Execute,"TLSet 2, XY(1.000' in str(told.value)
    with pytest.raises(AssertionError, match="was sent 1 times"):
        epson_sim.wire.assert_not_sent("TLSet 2, XY")
    epson_sim.motions.assert_none()
    simulator = epson_sim.simulator
    simulator.machine.motions.add(0, lambda: (1.0, 2.0, 3.0))
    with pytest.raises(AssertionError, match=r"(?s)1 motions began.*to 1\.000 2\.000 3\.000"):
        epson_sim.motions.assert_none()


def test_a_cell_is_put_back_between_two_looks(epson_sim, softmotion_sim, fault_plan):
    for cell in (epson_sim, softmotion_sim):
        at_first = cell.truth()
        write(cell)
        cell.snapshot("written")
        cell.do("change_nozzle")
        fault_plan(cell, "drop_reply")
        cell.simulator._motion_log().add(0)
        assert cell.motions.count == 1
        cell.put_back()
        assert {**cell.do("counters"), "starts": 0} == dict.fromkeys(cell.do("counters"), 0)
        cell.motions.assert_none()
        assert cell.truth() == at_first
        assert not cell.wire.lines
        assert fault_plan(cell)["pending"] == []
        cell.restore("written")
        assert cell.truth()["stored"]["2"]["z_mm"] == pytest.approx(WANTED.z_mm)


def test_the_journal_of_the_test_tells_what_was_done(epson_factory, robolink_journal):
    """On a port; an in-process journal stays in the process."""
    cell = epson_factory(medium="tcp")
    with robolink.connect(cell.url) as controller:
        change_tools(controller, [Wanted(2, WANTED, robolink.ANY)])
        who = controller.outcomes.identity
    assert who.startswith("epson:C-SIM")
    (entry,) = robolink_journal.entries(controller=who, kinds=[EntryKind.DONE])
    assert entry.tool == 2


def change_nozzle(cell):
    done = cell.run("change", str(cell.recipe), *cell.by_hand)
    assert done.exit_code == 0, done.messages + done.out
    truth = cell.truth()
    for name in ("x_mm", "y_mm"):
        assert truth["stored"]["1"][name] == pytest.approx(truth["tips"]["1"][name], abs=0.06)
    assert cell.motions.count


@pytest.mark.soak
@pytest.mark.parametrize("kind", ["epson", "softmotion"])
def test_a_nozzle_is_changed_in_a_cell_with_its_recipe(kind, request):
    change_nozzle(request.getfixturevalue(f"{kind}_cell"))


@pytest.mark.soak
@pytest.mark.parametrize("program", [""], indirect=True)
def test_a_nozzle_is_changed_in_a_cell_whose_program_is_executed(program, softmotion_factory):
    change_nozzle(softmotion_factory(medium="modbus-tcp", person=True, program=program))


LIGHT = """
import sys
import robolink_simulators.pytest_plugin
heavy = {"numpy", "lark", "pymodbus", "can", "canopen", "psycopg", "pydantic", "click"}
assert not heavy & set(sys.modules)
ours = [name for name in sys.modules if name.startswith("robolink")]
assert ours == ["robolink_simulators", "robolink_simulators.pytest_plugin"], ours
"""


def test_the_plugin_is_light():
    subprocess.run([sys.executable, "-c", LIGHT], check=True, timeout=60)


FAILING = """
import gc
import weakref
import pytest

held = []

def test_passes(epson_sim):
    held.append(weakref.ref(epson_sim.simulator))

def test_the_cells_of_a_test_are_gone_with_it():
    gc.collect()
    assert held[0]() is None

def test_fails(epson_sim, softmotion_sim):
    import robolink
    with robolink.connect(epson_sim.url) as controller:
        controller.status()
    epson_sim.wire.assert_sent("nothing of the kind")

def test_a_command_is_told_what_the_test_says_alone(epson_sim, monkeypatch):
    assert "ROBOLINK_PASSWORD" not in epson_sim._environment()
    monkeypatch.setenv("ROBOLINK_PASSWORD", "of-the-test")
    assert epson_sim._environment()["ROBOLINK_PASSWORD"] == "of-the-test"
    assert "PATH" in epson_sim._environment()

@pytest.mark.robolink(colour="red")
def test_asks_for_what_there_is_not(epson_sim):
    pass

@pytest.mark.robolink(kinematics="Kin_5Axes")
def test_asks_for_what_this_kind_does_not_have(epson_sim):
    pass

@pytest.mark.robolink(kinematics="Kin_5Axes", robot="C8-C901S")
class TestMarkedTogether:
    def test_of_one_kind(self, epson_sim):
        assert epson_sim.simulator.robot_name == "C8-C901S"

    @pytest.mark.robolink(kinematics="Kin_Gantry3")
    def test_of_both(self, epson_sim, softmotion_sim):
        assert softmotion_sim.simulator.machine_name.endswith("Kin_Gantry3")

def test_whose_cue_never_came(epson_sim):
    epson_sim.operator.when("TLSet", "press_estop")

def test_whose_person_could_not_do_it(epson_sim):
    import robolink
    epson_sim.operator.when("GetStatus", "restore", name="nothing")
    with robolink.connect(epson_sim.url) as controller:
        controller.status()

def test_whose_clock_is_that_of_no_cell(virtual_clock, epson_factory):
    epson_factory(medium="tcp")
    virtual_clock.advance(3.0)

def test_one_of_whose_cells_keeps_the_clock(virtual_clock, epson_sim, epson_tcp):
    virtual_clock.advance(3.0)

def test_that_is_skipped_in_the_middle(epson_sim):
    epson_sim.operator.when("TLSet", "press_estop")
    pytest.skip("for another reason")

tries = []

def test_that_is_tried_again_and_whose_cue_never_came_again(epson_sim):
    tries.append(epson_sim)
    epson_sim.operator.when("TLSet", "press_estop")
    assert len(tries) == 2
"""

AGAIN = """
from _pytest.runner import runtestprotocol

def pytest_runtest_protocol(item, nextitem):
    if "tried_again" in item.name:
        first = runtestprotocol(item, nextitem=nextitem, log=False)  # as plugins that rerun do
        assert sum("robolink wire" in heading for heading, _ in first[1].sections) == 1
"""


@pytest.mark.parametrize("shared", [(), pytest.param(("-n", "2"), marks=pytest.mark.soak)], ids=str)
def test_a_test_that_fails_shows_wire_seed_and_state(tmp_path, shared):
    (tmp_path / "test_theirs.py").write_text(FAILING)
    (tmp_path / "conftest.py").write_text(AGAIN)
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "tests._program",
            "import sys, pytest; sys.exit(pytest.main(sys.argv[1:]))",
            "-p",
            "no:cacheprovider",
            "--robolink-seed",
            "7",
            "--strict-markers",
            "--junitxml=report.xml",
            "-W",
            "ignore::pytest.PytestAssertRewriteWarning",  # of what a forked process has imported
            *shared,
        ],
        cwd=tmp_path,
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
            "ROBOLINK_PASSWORD": "of-another-cell",
        },
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    shown = done.stdout
    assert "1 failed, 10 passed, 1 skipped, 6 errors" in shown
    assert "robolink: " not in shown  # no header
    assert "robolink wire: epson T6-602S, seed 7, epson+sim://pytest-" in shown
    assert "robolink state: softmotion Kin_Scara3_Z, seed 7" in shown
    assert "> $GetStatus" in shown
    assert '"pin_mm"' in shown
    # The second try does not show the cell of the first.
    assert shown.count("robolink wire: epson") == 5
    assert "has no parameter 'colour'" in shown
    assert "(nothing moved)" in shown
    assert "kind (epson) uses 'kinematics'" in shown
    assert "No request came that contains 'TLSet', at which press_estop was to be done." in shown
    assert "No cell of this test keeps the time of virtual_clock" in shown
    assert "restore could not be done: There is no snapshot 'nothing'." in shown
    attached = properties(tmp_path / "report.xml", "test_fails")
    assert [name.partition(":")[0] for name in attached] == [
        *("robolink wire", "robolink motions", "robolink state") * 2
    ]
    wire, *_ = attached.values()
    assert "> $GetStatus" in wire
    late = properties(tmp_path / "report.xml", "test_whose_cue_never_came")
    assert len(late) == 3
    assert properties(tmp_path / "report.xml", "test_passes") == {}


def properties(path, test):
    """Return a test's properties in the file for a pipeline, by name."""
    found = ElementTree.parse(path).getroot().iterfind(f".//testcase[@name='{test}']//property")
    return {one.get("name"): one.get("value") for one in found}


@pytest.mark.parametrize(
    ("make", "medium"), [(make_epson, "sim"), (make_softmotion, "sim"), (make_softmotion, "can")]
)
def test_what_was_recorded_of_a_cell_in_the_process_goes_with_it(
    make, medium, tmp_path, robolink_state
):
    """Otherwise ten thousand tests would keep ten thousand records."""
    with ExitStack() as stack:
        cell = make(OwnFolder(stack, tmp_path, 1, []), CellRequest(), medium, None)
        with robolink.connect(cell.url) as controller:
            identity = controller.identity
            controller.tools.write(2, WANTED, expected=robolink.ANY)
        record = memory_journal(identity)
        assert any(record.entries())
    assert memory_journal(identity) is not record
    assert not any(memory_journal(identity).entries())
    forget_memory(parse_url(cell.url).identity)
