"""Inputs, outputs, memory bits, variables, alarms and data of a controller."""

import pytest
from robolink_simulators.epson.device import EpsonSimulator

from robolink.errors import (
    ConfigError,
    ControllerFaultError,
    NotReadyError,
    NotReadyReason,
    ReadBackError,
    RejectedError,
    RemoteProtocolError,
)
from robolink.model import ControllerFacts
from robolink.protocols.epson_text import VariableType
from tests.contract.conftest import served


@pytest.fixture
def simulator():
    return EpsonSimulator(seed=2)


@pytest.fixture
def connected(serve, simulator):
    with serve(simulator) as cell, cell.connect() as controller:
        yield controller


@pytest.fixture(scope="module")
def standing(tmp_path_factory):
    """A simulator and a connection to it that lasts for the module."""
    simulator = EpsonSimulator(seed=2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROBOLINK_STATE_DIR", str(tmp_path_factory.mktemp("standing")))
        with served("sim", simulator) as cell, cell.connect() as controller:
            yield simulator, controller


@pytest.fixture
def silent(standing):
    """A connection over which the test sends nothing."""
    simulator, controller = standing
    before = len(simulator.log)
    yield controller
    assert len(simulator.log) == before


def asked(simulator):
    return [text for _, direction, text in simulator.log if direction == ">"]


@pytest.mark.on_every_link
def test_inputs_are_read_by_bit_byte_and_word(simulator, connected):
    for bit in (0, 3, 8, 511):
        simulator.machine.inputs.set(bit, True)
    io = connected.io
    assert [io.read_input(bit) for bit in (0, 1, 3, 511)] == [True, False, True, True]
    assert io.read_input_byte(0) == 0b1001
    assert io.read_input_word(0) == 0b1_0000_1001
    assert io.read_input_byte(63) == 0x80


def test_memory_is_read_by_bit_byte_and_word(simulator, connected):
    for bit in (1, 15):
        simulator.machine.memory.set(bit, True)
    io = connected.io
    assert (io.read_memory(1), io.read_memory(2)) == (True, False)
    assert (io.read_memory_byte(1), io.read_memory_word(0)) == (0x80, 0x8002)


@pytest.mark.on_every_link
def test_an_output_and_a_memory_bit_are_switched_once_and_read_back(simulator, connected):
    for switch, bank in (
        (connected.io.set_output, simulator.machine.outputs),
        (connected.io.set_memory, simulator.machine.memory),
    ):
        receipt = switch(5, True)
        assert bank.get(5)
        assert (receipt.before, receipt.read_back, receipt.skipped) == (False, True, False)
        assert switch(5, True).skipped
        assert switch(5, False).read_back is False
    assert connected.io.read_output(5) is False
    assert connected.outcomes.open_markers() == ()
    sets = [text for text in asked(simulator) if text.startswith("$Set")]
    assert sets == ["$SetIO,5,1", "$SetIO,5,0", "$SetMemIO,5,1", "$SetMemIO,5,0"]


def test_a_preview_names_the_request_and_sends_none_of_it(simulator, connected):
    assert connected.io.preview_output(7, True) == ("$SetIO,7,1",)
    assert connected.io.preview_output(7, False) == ()
    assert connected.io.preview_memory(7, True) == ("$SetMemIO,7,1",)
    preview = connected.variables.preview_write("g_Long", -4, "Long")
    assert preview == ("$SetVariable,g_Long,-4,Long",)
    assert not any(text.startswith("$Set") for text in asked(simulator))


@pytest.mark.parametrize("bit", [-1, 65536, True, "3"])
def test_a_bit_that_cannot_be_is_not_asked_for(silent, bit):
    for act in (silent.io.read_input, silent.io.read_output, silent.io.read_memory_word):
        with pytest.raises(ConfigError):
            act(bit)
    with pytest.raises(ConfigError):
        silent.io.set_output(bit, True)


def test_a_bit_that_this_controller_lacks_is_refused_by_it(connected):
    with pytest.raises(RejectedError) as caught:
        connected.io.read_input(9999)
    assert caught.value.code == 12


@pytest.mark.remote_ethernet
@pytest.mark.parametrize("answer", ["2", "", "0F ", "1F", "on"])
def test_a_bit_that_is_neither_0_nor_1_ends_in_an_error(simulator, connected, answer):
    simulator._desk._served["getio"] = lambda at: (answer,)
    with pytest.raises(RemoteProtocolError, match="GetIO"):
        connected.io.read_input(0)


@pytest.mark.remote_ethernet
@pytest.mark.parametrize("answer", ["0", "F", "FFF", "0x0F", "GG", " 0F", "+1", "1_0"])
def test_hexadecimal_text_is_read_strictly(simulator, connected, answer):
    simulator._desk._served["getiobyte"] = lambda at: (answer,)
    with pytest.raises(RemoteProtocolError, match="GetIOByte"):
        connected.io.read_input_byte(0)


def test_an_output_that_does_not_follow_is_an_error_and_is_not_sent_again(simulator, connected):
    simulator._desk._served["setio"] = lambda at, value: ()
    with pytest.raises(ReadBackError):
        connected.io.set_output(3, True)
    assert asked(simulator).count("$SetIO,3,1") == 1


@pytest.mark.remote_ethernet
@pytest.mark.parametrize(
    ("prepare", "reason"),
    [
        (lambda panel: panel.set_monitoring_only(True), NotReadyReason.NOT_REMOTE),
        (lambda panel: panel.start_production(), NotReadyReason.RUNNING),
        (lambda panel: panel.open_guard(), NotReadyReason.GUARD_OPEN),
        (lambda panel: panel.teach(), NotReadyReason.TEACH),
    ],
)
def test_nothing_is_set_in_a_state_that_forbids_it_and_all_is_read(
    simulator, connected, prepare, reason
):
    prepare(simulator.panel)
    acts = [
        lambda: connected.io.set_output(1, True),
        lambda: connected.io.set_memory(1, True),
        lambda: connected.io.read_output(1),
        lambda: connected.io.preview_output(1, True),
        lambda: connected.variables.write("g_Long", 1, "Long"),
        lambda: connected.alarms.reset(5),
    ]
    for act in acts:
        with pytest.raises(NotReadyError) as caught:
            act()
        assert caught.value.reason is reason
    assert connected.io.read_input(0) is False
    assert connected.io.read_memory_byte(0) == 0
    assert connected.variables.read("g_Long", "Long") == 0
    assert connected.alarms.list() == ()
    assert connected.facts().robot_models == ("T6-602S",)
    assert not any(text.startswith(("$Set", "$Execute", "$Reset")) for text in asked(simulator))
    assert connected.outcomes.open_markers() == ()


@pytest.mark.remote_ethernet
@pytest.mark.parametrize(
    ("kind", "value"),
    [
        ("Boolean", True),
        ("Byte", -128),
        ("Integer", 32767),
        ("Long", -(2**31)),
        ("Long", 2**31 - 1),
        ("Real", 0.1),
        ("Real", -1.25e20),
        ("Double", 1 / 3),
        ("Double", 1.5e-7),
    ],
)
def test_a_variable_of_each_type_is_written_and_read_back(connected, kind, value):
    name = f"g_{kind}"
    receipt = connected.variables.write(name, value, kind)
    assert receipt.before == 0
    assert connected.variables.read(name, kind) == pytest.approx(value, rel=1e-5)
    assert type(receipt.read_back) is type(value)
    assert connected.variables.write(name, value, VariableType(kind)).skipped


@pytest.mark.remote_ethernet
def test_a_string_is_written_and_read_back(connected):
    connected.variables.write("VERSION$", "cell 7 / rev. A-2", "string")
    assert connected.variables.read("VERSION$", "String") == "cell 7 / rev. A-2"
    assert connected.variables.text("VERSION$") == "cell 7 / rev. A-2"


@pytest.mark.remote_ethernet
def test_elements_of_an_array_are_read_from_a_subscript_on(simulator, connected):
    for i in range(3):
        simulator.variables.set(f"g_Real_table(2,{i + 1})", str(i + 0.5), "Real")
    read = connected.variables.read_array("g_Real_table", (2, 1), "Real", count=3)
    assert read == (0.5, 1.5, 2.5)
    with pytest.raises(RejectedError) as caught:
        connected.variables.read_array("g_Real_table", (2, 1), "Real", count=6)
    assert caught.value.code == 15


@pytest.mark.remote_ethernet
def test_an_array_that_comes_back_short_is_not_taken(simulator, connected):
    simulator._desk._served["getvariable"] = lambda *asked: ("1", "2")
    with pytest.raises(RemoteProtocolError, match="3 elements"):
        connected.variables.read_array("g_Long_table", (0, 0), "Long", count=3)


@pytest.mark.parametrize("name", ["", "a b", "a;b", 'a"', "a(0)", "$a", "a$b", "1a", "é", "a" * 40])
def test_no_other_text_than_a_name_reaches_the_wire(silent, name):
    for act in (
        lambda: silent.variables.text(name),
        lambda: silent.variables.read(name, "Long"),
        lambda: silent.variables.read_array(name, (0,), "Long"),
        lambda: silent.variables.write(name, 1, "Long"),
    ):
        with pytest.raises(ConfigError):
            act()


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (128, "Byte"),
        (1.0, "Long"),
        (True, "Long"),
        (1, "Boolean"),
        (float("nan"), "Real"),
        (1e39, "Real"),
        (float("inf"), "Double"),
        ("a,b", "String"),
        ('say "x"', "String"),
        (" blank", "String"),
        ("", "String"),
        ("line\r\n$Reset", "String"),
        (5, "String"),
        ("5", "Long"),
        (5, "Point"),
    ],
)
def test_a_value_that_the_type_cannot_hold_is_not_sent(silent, value, kind):
    with pytest.raises(ConfigError):
        silent.variables.write("g_any", value, kind)


@pytest.mark.parametrize("indices", [(), (0, 0, 0, 0), (-1,), (True,), ("0",)])
def test_subscripts_are_one_to_three_whole_numbers(silent, indices):
    with pytest.raises(ConfigError, match="subscripts"):
        silent.variables.read_array("g_Long_table", indices, "Long")


@pytest.mark.parametrize(("kind", "count"), [("String", 1), ("Long", 0), ("Long", 101)])
def test_what_no_request_can_ask_for_is_refused_here(silent, kind, count):
    with pytest.raises(ConfigError):
        silent.variables.read_array("g_Long_table", (0, 0), kind, count=count)


@pytest.mark.remote_ethernet
def test_alarms_are_listed_and_reset(simulator, connected):
    assert connected.alarms.list() == ()
    simulator.panel.raise_alarm(501)
    simulator.panel.raise_alarm(502)
    assert connected.alarms.list() == (501, 502)
    connected.alarms.reset(501)
    assert connected.alarms.list() == (502,)
    with pytest.raises(RejectedError):
        connected.alarms.reset(777)
    with pytest.raises(ConfigError):
        connected.alarms.reset(0)


@pytest.mark.remote_ethernet
def test_an_alarm_that_comes_back_is_an_error(simulator, connected):
    simulator.panel.raise_alarm(501)
    simulator._desk._served["resetalm"] = lambda number: ()
    with pytest.raises(ControllerFaultError, match="501 is still on"):
        connected.alarms.reset(501)


@pytest.mark.remote_ethernet
def test_alarms_that_contradict_their_count_are_not_taken(simulator, connected):
    simulator._desk._served["getalm"] = lambda: ("2", "501")
    with pytest.raises(RemoteProtocolError, match="2 alarms"):
        connected.alarms.list()


@pytest.mark.remote_ethernet
def test_facts_name_the_controller_and_the_robot(simulator, connected):
    serial = simulator.machine.serial
    assert connected.facts() == ControllerFacts(
        controller_name="SIMULATED",
        controller_type="SIMULATOR",
        controller_serial=f"C-{serial}",
        firmware="7.5.4.0",
        project="robolink",
        robot_number=1,
        robot_models=("T6-602S",),
        robot_serials=(serial,),
    )


def test_older_firmware_prints_its_robot_and_hides_the_rest(serve, options):
    simulator = EpsonSimulator(options=options(extended_queries=False))
    with serve(simulator) as cell, cell.connect() as controller:
        facts = controller.facts()
        assert facts.robot_models == ("T6-602S",)
        assert facts.robot_serials == (simulator.machine.serial,)
        assert (facts.firmware, facts.controller_serial, facts.robot_number) == (None, None, 1)
        simulator.panel.start_production()
        assert controller.facts() == ControllerFacts(robot_number=1)
        simulator.panel.stop_production()


@pytest.mark.remote_ethernet
def test_facts_that_only_a_restart_changes_are_asked_once_in_a_session(simulator, connected):
    first, before = connected.facts(), len(asked(simulator))
    assert connected.facts() == first
    assert asked(simulator)[before:] == ["$GetCurRobot", "$GetPrjName"]


@pytest.mark.remote_ethernet
def test_a_strange_answer_about_the_robots_is_left_out(simulator, connected):
    simulator._desk._served["getrobotserial"] = lambda robot: ("2", "A1")
    simulator.panel.set_monitoring_only(True)
    assert connected.facts().robot_serials == ()


@pytest.mark.remote_ethernet
def test_facts_of_two_robots_are_read(simulator, connected):
    simulator._desk._served["getrobotinfo"] = lambda: ("2", "3", "T6-602S", "5", "C8-C901S")
    simulator._desk._served["getrobotserial"] = lambda robot: ("2", "A1", " B2 ")
    simulator._desk._served["getcontname"] = lambda: ("0",)
    simulator._desk._served["getcontver"] = lambda: (" 7. 5.1 ",)
    facts = connected.facts()
    assert facts.robot_models == ("T6-602S", "C8-C901S")
    assert facts.robot_serials == ("A1", "B2")
    assert (facts.controller_name, facts.firmware) == (None, "7.5.1")
