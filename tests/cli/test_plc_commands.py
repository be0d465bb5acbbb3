"""The command line's messages about a PLC, and the PLC for which a map was confirmed."""

import json
from itertools import count
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.hosting.in_process import epson, softmotion
from robolink_simulators.plc import PlcSimulator, serve_plc
from robolink_simulators.softmotion.mailbox import MailboxOptions, PlcOptions, SoftMotionSimulator

import robolink
from robolink.controllers import SoftMotionController
from robolink.errors import RobolinkError
from robolink.journal import memory_journal, open_journal
from robolink.model import ANY, EntryKind, ToolOffset
from robolink.register_maps import RegisterTable, load_map
from tests.cli.test_plc_map_commands import MAPS as CONFIRMED_MAPS
from tests.faults._second_address import SecondAddress

# The command line's messages about a PLC, and how a person takes its mailbox over.

MAPS = Path("examples/plc-maps").absolute()
_names = count()


@pytest.fixture
def shown(state_folder, capsys):
    """Run a command line; return exit code, stdout and stderr."""

    def ran(*arguments):
        code = main.run(arguments)
        out, err = capsys.readouterr()
        return code, out, err

    return ran


@pytest.fixture
def serve():
    """Serve a PLC in this process; return its URL and the simulator."""
    served = []

    def made(*faults, **options):
        mailbox = MailboxOptions(**options)
        simulator = SoftMotionSimulator(options=PlcOptions(mailbox=mailbox), faults=faults)
        served.append(f"plc-commands-{next(_names)}")
        return softmotion.register(served[-1], simulator), simulator

    yield made
    for name in served:
        softmotion.unregister(name)


def commands(simulator):
    return [text for _, way, text in simulator.log if way == ">" and text.startswith("write")]


def test_where_says_nothing_of_what_a_plc_has_not(shown, serve):
    url, _ = serve()
    code, out, _ = shown("-c", url, "where")
    assert (code, "None" in out) == (0, False)
    assert out.startswith("tool 1 ")
    assert "axes: 34.000" in out
    assert "hand" not in out


def test_where_prints_no_none_of_any_kind_of_controller(shown, state_folder):
    path = MAPS / "commit-bit.toml"
    plc = serve_plc(PlcSimulator(load_map(path), seed=1), path)
    name = f"plc-commands-{next(_names)}"
    try:
        for url in (plc.url, epson.register(name, EpsonSimulator())):
            code, out, _ = shown("-c", url, "where")
            assert (code, "None" in out) == (0, False)
    finally:
        plc.close()
        epson.unregister(name)


def test_a_mailbox_is_looked_at_and_nothing_is_written(shown, serve):
    url, simulator = serve(device_id=0x1234_BEEF)
    code, out, _ = shown("-c", url, "verify-controller")
    assert code == 0
    for words in (
        "1.0",
        "12.3456",
        "1234BEEF",
        "15 whole, checksums right; defined: 1",
        "19, with",
    ):
        assert words in out
    assert "NO" not in out.split()
    code, out, _ = shown("-c", url, "--json", "verify-controller")
    document = json.loads(out)
    assert document["schema"] == "robolink/mailbox-verification/1"
    assert all(one["right"] for one in document["findings"])
    assert {one["name"] for one in document["findings"]} > {"PLC heartbeat", "permit (xPermit)"}
    assert commands(simulator) == []


def test_a_slot_with_the_values_of_no_tool_is_shown_refused_and_put_right(shown, serve):
    url, simulator = serve()
    simulator.plc.memory.define(3, (-1.5e-27, 1.6e-314, -10.0, 0.0, 0.0, 0.0), "Tool 3")
    _, out, _ = shown("-c", url, "tool", "list")
    assert "values that are no tool: 3" in out
    code, _, err = shown("-c", url, "tool", "select", "3")
    assert (code, "'robolink tool clear'" in err) == (5, True)
    code, out, _ = shown("-c", url, "verify-controller")
    assert "these cannot be used: 3" in out
    code, out, _ = shown("-c", url, "tool", "set", "3", "--x", "1.25")
    assert (code, "written, read back" in out) == (0, True)
    _, out, _ = shown("-c", url, "--json", "tool", "get", "3")
    assert list(json.loads(out)["offset"].values()) == [1.25, 0, 0, 0, 0, 0]
    assert shown("-c", url, "tool", "select", "3")[0] == 0


def test_what_is_wrong_with_a_mailbox_is_named_with_a_remedy(shown, serve):
    torn = [
        PlcFault(PlcFaultAction.TEAR_REPLY, match="read_slot 3", on_exchange=n) for n in range(3)
    ]
    url, simulator = serve(*torn, identified=False, profile="tools")
    simulator.panel.withdraw_permit()
    code, out, _ = shown("-c", url, "--json", "verify-controller")
    found = {one["name"]: one for one in json.loads(out)["findings"]}
    assert code == 0
    slots, number = found["tool slots"], found["PLC number (device_id)"]
    assert (slots["right"], slots["finding"]) == (False, "these cannot be used: 3")
    assert (number["right"], "known by its address" in number["finding"]) == (False, True)
    assert slots["remedy"]
    assert number["remedy"]
    assert found["opcodes"]["finding"] == "5, without motion"
    assert found["permit (xPermit)"]["finding"] == "not given: reading only"


def test_what_is_for_epson_controllers_only_is_refused_of_a_plc(shown, serve, tmp_path):
    url, _ = serve()
    code, _, err = shown("-c", url, "verify-controller", "--profile", str(tmp_path / "x.json"))
    assert (code, "EPSON controllers only" in err) == (2, True)
    path = MAPS / "commit-bit.toml"
    code, _, err = shown("-c", f"plc+modbus-tcp://127.0.0.1:9?map={path}", "verify-controller")
    assert (code, "plc check-map" in err) == (2, True)


def another_client(url):
    controller = robolink.connect(url, outcomes=memory_journal("other").log(url))
    assert isinstance(controller, SoftMotionController)
    return controller


@pytest.fixture
def held(serve):
    """Serve a PLC whose mailbox another client has locked."""
    url, simulator = serve()
    with another_client(url) as other:
        other.take()
        yield url, simulator, other


def test_the_holder_is_named_and_nobody_is_overridden_without_a_person(shown, held):
    url, simulator, other = held
    holder = f"{simulator.plc.program.ownership.holder:08X}"
    code, _, err = shown("-c", url, "take-ownership")
    assert code == 9
    assert holder in err
    assert "--yes" in err
    other.tools.write(5, ToolOffset(1.0), expected=None)  # it was not disturbed


def test_a_person_insists_and_the_mailbox_is_free_afterwards(shown, held):
    url, simulator, other = held
    holder = f"{simulator.plc.program.ownership.holder:08X}"
    code, out, _ = shown("-c", url, "take-ownership", "--yes")
    assert (code, holder in out, "free now" in out) == (0, True, True)
    assert simulator.plc.program.ownership.holder == 0
    with pytest.raises(RobolinkError):
        other.tools.write(5, ToolOffset(1.0), expected=ANY)
    assert shown("-c", url, "tool", "set", "5", "--x", "2", "--yes")[0] == 0


def test_that_a_person_insisted_is_on_record(shown, tmp_path):
    simulator = SoftMotionSimulator(state_path=tmp_path / "plc.json")
    name = f"plc-commands-{next(_names)}"
    url = softmotion.register(name, simulator)
    try:
        with another_client(url) as other:
            other.take()
            assert shown("-c", url, "take-ownership", "--yes", "--operator", "Kim")[0] == 0
    finally:
        softmotion.unregister(name)
    entries = [it for it in open_journal().entries() if it.kind is EntryKind.DECISION]
    assert [(it.signature.operator, "taken from client" in it.verdict) for it in entries] == [
        ("Kim", True)
    ]


def test_a_free_mailbox_is_not_fought_for(shown, serve):
    url, simulator = serve()
    code, out, _ = shown("-c", url, "take-ownership")
    assert (code, "No other client had" in out) == (0, True)
    assert simulator.plc.program.ownership.holder == 0


def test_a_dry_run_sends_no_mailbox_command(shown, held):
    url, simulator, _other = held
    before = len(commands(simulator))
    code, out, _ = shown("-c", url, "take-ownership", "--dry-run")
    assert (code, "30005 OWNERSHIP 1 1" in out) == (0, True)
    assert len(commands(simulator)) == before


# A person's confirmation of a map counts for one PLC, whatever its URL, and for no other one.

NUMBER_AT = 60
NUMBER = f"""
[device_id]
table = "holding"
address = {NUMBER_AT}
"""


@pytest.fixture
def shown_to(state_folder, capsys):
    """Run a command line; return the exit code and the output for a person."""

    def ran(*arguments):
        code = main.run(arguments)
        return code, capsys.readouterr().err

    return ran


@pytest.fixture
def machine(state_folder, tmp_path):
    """A map without a probe, with the place of the PLC's own number, and such a PLC."""
    path = tmp_path / "machine.toml"
    text = (CONFIRMED_MAPS / "no-handshake.toml").read_text(encoding="utf-8")
    path.write_text(text + NUMBER, encoding="utf-8")
    return path, PlcSimulator(load_map(path), seed=1)


def number(plc, value):
    plc.program.memory.write(RegisterTable.HOLDING, NUMBER_AT, [value, 0])


def compare(url):
    return ["-c", url, "plc", "check-map", "--shows", "1.x=-5.44", "--operator", "Kim"]


def write(url):
    return ["-c", url, "tool", "set", "1", "--x", "2.5", "--dry-run"]


def test_another_spelling_of_the_host_keeps_the_confirmation(shown_to, state_folder):
    path = CONFIRMED_MAPS / "no-handshake.toml"
    host = serve_plc(PlcSimulator(load_map(path), seed=1), path)
    with host, SecondAddress(host.url) as second:
        assert shown_to(*compare(host.url))[0] == 0
        assert shown_to(*write(host.url.replace("127.0.0.1", "localhost")))[0] == 0
        # Without a number of its own it might be another PLC.
        code, err = shown_to(*write(second.url))
        assert (code, "Nobody has compared" in err) == (2, True)


def test_a_plc_with_a_number_keeps_it_at_each_of_its_addresses(shown_to, machine):
    path, plc = machine
    number(plc, 4711)
    with serve_plc(plc, path) as host, SecondAddress(host.url) as second:
        assert shown_to(*write(second.url))[0] == 2
        assert shown_to(*compare(host.url))[0] == 0
        assert shown_to(*write(second.url))[0] == 0
        code, err = shown_to("-c", second.url, "plc", "check-map", "--shows", "1.x=9.99")
        assert (code, "The confirmation by Kim" in err, "withdrawn" in err) == (2, True, True)
        assert shown_to(*write(host.url))[0] == 2


def test_another_plc_at_the_same_address_does_not_inherit_it(shown_to, machine):
    path, plc = machine
    number(plc, 4711)
    with serve_plc(plc, path) as host:
        assert shown_to(*compare(host.url))[0] == 0
        number(plc, 4712)
        code, err = shown_to(*write(host.url))
        assert (code, "Nobody has compared" in err) == (2, True)
        number(plc, 0)  # a program that has not started yet
        code, err = shown_to(*write(host.url))
        assert (code, "reads zero" in err) == (5, True)
        number(plc, 4711)
        assert shown_to(*write(host.url))[0] == 0
    assert plc.writes == []
