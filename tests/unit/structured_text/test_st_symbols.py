"""The program for OPC UA: its commands come from the list RL_Symbols, which a server may tear."""

import pytest
from robolink_cli import main
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.softmotion.mailbox.plc import Plc
from robolink_simulators.softmotion.program.structured_plc import plc_maker

from robolink.protocols.mailbox import Opcode, encode_command, heartbeat_word
from tests.unit._mailbox_client import linked
from tests.unit.structured_text import _behaviours as b

LIST = "RL_Symbols"
CYCLE_S = 0.004
TOOL = (1.5, -2.5, 60.25, 0.0, 0.0, 0.0)
LAST_WORD = 63


def cases():
    for behaviour, kinematics in b.RUNS:
        marks = () if behaviour is b.b13_a_stop_is_held else pytest.mark.soak
        name = f"{behaviour.__name__}-{kinematics}"
        yield pytest.param(behaviour, kinematics, marks=marks, id=name)


@pytest.mark.parametrize(("behaviour", "kinematics"), list(cases()))
def test_it_answers_with_the_words_of_the_model(tmp_path, behaviour, kinematics):
    model = b.taken(tmp_path, behaviour, kinematics, Plc)
    program = b.taken(tmp_path, behaviour, kinematics, b.of_program(opcua=True))
    assert len(model) > 1
    assert program == model


@pytest.fixture(scope="module")
def owned():
    """A client that owns the mailbox of a PLC which executes that program."""
    simulator = SoftMotionSimulator(make_plc=b.of_program(opcua=True))
    client = linked(simulator)
    client.take()
    return client, simulator


def torn(whole, old, cut, kept):
    """Return an array of which a server has written a part: before ``cut``, behind it, or both."""
    if kept == "head":
        return whole[:cut] + old[cut:]
    if kept == "tail":
        return old[:cut] + whole[cut:]
    return whole[:cut] + old[cut:57] + whole[max(cut, 57) :]


SOME = {"head": (1, 9, 57, 62), "tail": (2, 33, 61, 62), "ends": (1, 2, 9, 33)}
ALL = [
    pytest.param(kept, range(1, LAST_WORD), marks=pytest.mark.soak, id=f"all-{kept}")
    for kept in SOME
]


@pytest.mark.parametrize(("kept", "cuts"), [*SOME.items(), *ALL])
def test_a_torn_command_is_not_carried_out_and_the_whole_one_is_once(owned, cuts, kept):
    client, simulator = owned
    counter, tried = client.slot(7).counter, 0
    for number, cut in enumerate(cuts, 1):
        tool = (number + 1 / 3, -number / 7, number * 2 / 3, *TOOL[3:])
        old = simulator.plc.program.inbox.words
        command = client.command(Opcode.WRITE_TOOL, 7, pose=tool, name=f"tip {kept}")
        whole = encode_command(command, heartbeat=heartbeat_word(client.epoch, 1))
        halves = torn(whole, old, cut, kept)
        client.link.write_command(halves)
        client.wait(2 * CYCLE_S)
        if (*halves[:62], halves[63]) != (*whole[:62], whole[63]):
            tried += 1
            assert client.now().ack_head != command.sequence, (cut, kept)
            assert client.slot(7).counter == counter
        client.link.write_command(whole)
        client.acknowledged(command)
        counter += 1
        client.wait(2 * CYCLE_S)
        slot = client.slot(7)
        assert (slot.counter, slot.tool) == (counter, tool), (cut, kept)
    assert tried >= 3


def test_the_heartbeat_is_a_node_of_its_own(owned):
    """What stands in the array's own word 62 keeps no movement alive, and ends none."""
    client, simulator = owned
    client.beat()
    client.link.clock.sleep(2 * CYCLE_S)
    client.now()
    program = simulator.plc.program.structured
    assert program.value(f"{LIST}.command")[62] == 0
    assert program.value(f"{LIST}.heartbeat") == heartbeat_word(client.epoch, client.beats)
    words = program.value(f"{LIST}.command")
    program.put(f"{LIST}.command", [*words[:62], 0x1234, words[63]])
    program.cycle(0)
    assert program.value("command")[62] == heartbeat_word(client.epoch, client.beats)


def test_whoever_reads_that_a_slot_was_written_finds_it_written():
    """A server reads between two statements of the program, since it runs in another task."""
    lines = b.sources(opcua=True)[-1].text.splitlines()
    shown = [at for at, line in enumerate(lines) if "RL_Symbols.response[" in line]
    slots = [at for at, line in enumerate(lines) if "RL_Symbols.slots[place] :=" in line]
    (table,) = (at for at, line in enumerate(lines) if line.startswith("table("))
    assert [table] < slots < shown
    assert [lines[at].split("[")[1].split("]")[0] for at in shown] == ["0", "place + 1", "113"]


def test_the_response_stands_between_two_counts_of_cycles(owned):
    client, simulator = owned
    program = simulator.plc.program.structured
    client.now()
    program.put("cycles", 0xFFFE)
    for count in (0xFFFF, 0, 1):
        program.cycle(0)
        first, *words, last = program.value(f"{LIST}.response")
        assert (first, last) == (count, count)
        assert words == program.value("response")


@pytest.mark.parametrize("profile", ["tools", pytest.param("full", marks=pytest.mark.soak)])
def test_the_simulator_runs_an_exported_one_from_its_folder(tmp_path, profile):
    folder = tmp_path / "plc"
    argv = ["plc", "export", str(folder), "--profile", profile, "--opcua"]
    assert main.run([*argv, "--kinematics", "Kin_Scara3_Z"]) == 0
    client = linked(SoftMotionSimulator(make_plc=plc_maker(folder)))
    client.take()
    client.done(Opcode.WRITE_TOOL, 5, pose=TOOL, name="needle")
    assert client.slot(5).tool == TOOL
    (folder / f"{LIST}.st").unlink()
    with pytest.raises(Exception, match=LIST):
        plc_maker(folder)


def test_it_has_no_registers(tmp_path, capsys):
    argv = ["plc", "export", str(tmp_path / "plc"), "--opcua", "--base", "100"]
    assert main.run(argv) == 2
    assert "--base" in capsys.readouterr().err
    assert not (tmp_path / "plc").exists()
