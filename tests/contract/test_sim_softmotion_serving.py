"""Simulated PLCs by name, with a simulated person, and in a process of their own."""

import json
import os
import select
import signal
import subprocess
import sys
from contextlib import closing, contextmanager

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.control.assist import AssistClient, open_eyes, serve_assist
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.in_process.softmotion import (
    clock_of,
    register,
    simulator_named,
    unregister,
)
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.errors import ConfigError
from robolink.protocols.mailbox import Bits, GroupState, Kinematics, Opcode, decode_response
from robolink.transport import open_mailbox_link, parse_url
from tests.unit._mailbox_client import MailboxClient


@pytest.fixture
def name():
    yield "plc-test"
    unregister("plc-test")


def test_a_named_plc_is_shared_by_name_and_made_as_its_url_says(name, tmp_path):
    query = "kinematics=Kin_Scara2_Z%2BKin_CAxis&dArmLength1=250&seed=4&unit_um=100&latch=edge"
    url = f"softmotion+sim://{name}"
    with (
        closing(open_mailbox_link(f"{url}?{query}")) as one,
        closing(open_mailbox_link(url)) as two,
    ):
        simulator = simulator_named(name)
        assert (simulator.seed, simulator.options.group.latch) == (4, "edge")
        assert one.clock is two.clock is clock_of(name)
        assert one.identity == two.identity == simulator.url == url
        assert not one.durable
        now = decode_response(one.read_response())
        assert (now.position_kinematics, now.orientation_kinematics) == (
            Kinematics.SCARA2_Z,
            Kinematics.C_AXIS,
        )
        assert now.unit_um == 100.0
    with pytest.raises(ConfigError, match="other options"):
        open_mailbox_link(f"{url}?seed=5")
    unregister(name)
    with closing(open_mailbox_link(f"{url}?state={tmp_path}/plc.json")) as link:
        assert link.durable


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ("colour=red", "kinematics, seed, state, faults, answer_ms"),
        ("kinematics=Kin_Nowhere", "no kinematics"),
        ("dArmLength1=long", "decimal number"),
        ("seed=x", "whole number"),
        ("profile=some", "full, tools"),
    ],
)
def test_a_wrong_option_is_named_and_leaves_no_simulator(name, query, words):
    with pytest.raises(ConfigError) as caught:
        open_mailbox_link(f"softmotion+sim://{name}?{query}")
    assert words in f"{caught.value} {caught.value.remedy}"
    with pytest.raises(ConfigError, match="No simulator"):
        simulator_named(name)


def test_each_exchange_takes_simulated_time_and_a_clock_of_the_caller_is_used(name):
    clock = ManualClock(77)
    link = open_mailbox_link(parse_url(f"softmotion+sim://{name}"), clock=clock)
    link.read_head()
    assert clock.now_ns() == 1_000_077
    with pytest.raises(ConfigError, match="taken"):
        register(name, SoftMotionSimulator())


@pytest.fixture
def assisted():
    simulator, clock = SoftMotionSimulator(seed=3), ScaledClock(20)
    with (
        serve_modbus_tcp(simulator, clock=clock) as host,
        serve_assist(simulator, clock=clock) as port,
        AssistClient(port.url) as assist,
        closing(open_mailbox_link(host.url)) as link,
    ):
        yield MailboxClient(link), assist, simulator


def test_the_assist_port_looks_jogs_and_tells_the_truth(assisted):
    client, assist, simulator = assisted
    assert assist.look(1) == simulator.world.operator.look()
    assist.jog_onto_pin()
    assert abs(assist.look().dx_mm) < 1e-6
    truth = assist.truth()
    assert truth == json.loads(json.dumps(simulator.truth()))
    x, y, z, *angles = client.slot(1).tool
    assert not any(angles)  # A, B, C of no rotation
    assert truth["stored"]["1"] == {
        "x_mm": x,
        "y_mm": y,
        "z_mm": z,
        **dict.fromkeys(("u_deg", "v_deg", "w_deg"), 0.0),
    }
    assert truth["selected_tool"] == 1
    assert assist.do("change_nozzle")["tip"] == assist.truth()["tips"]["1"]


def test_the_assist_port_pushes_buttons(assisted):
    client, assist, _ = assisted
    client.take()
    assist.do("press_estop")
    assert not client.now().bits & Bits.POWERED
    assist.do("release_estop")
    assist.do("withdraw_permit")
    assert not client.now().bits & Bits.PERMITTED
    assist.do("give_permit")
    assist.do("set_input", number=3, on=True)
    assert client.done(Opcode.READ_INPUT, 3).answer.input_value == 1
    assist.do("fail_axis", number=1)
    assert client.now().group_state == GroupState.ERRORSTOP
    assist.do("zero_inputs")
    assist.do("freeze")
    assert client.now() == client.now()
    assist.do("thaw")
    counters = assist.do("counters")
    assert (counters["moves_started"], counters["tool_writes"], counters["starts"]) == (0, 0, 1)
    with pytest.raises(ConfigError, match="axis 9"):
        assist.do("fail_axis", number=9)
    with pytest.raises(ConfigError, match="in error"):
        assist.jog_onto_pin()
    with pytest.raises(ConfigError, match="Choose one of"):
        assist.do("dance")


def test_the_assist_port_restarts_the_plc(assisted):
    _, assist, simulator = assisted
    assist.do("restart")
    assert simulator.plc.memory.boot_id == 2


def test_eyes_are_opened_on_a_plc_of_this_process(name):
    register(name, SoftMotionSimulator())
    with open_eyes(f"softmotion+sim://{name}") as eyes:
        assert eyes.look(1) == simulator_named(name).world.operator.look(1)


def environment():
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}


@contextmanager
def served(*arguments):
    process = subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", "sim", "softmotion", *arguments],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        readable, _, _ = select.select([process.stdout], [], [], 20)
        assert readable, "nothing was printed"
        yield process, process.stdout.readline()
    finally:
        process.kill()
        process.communicate()


def test_the_command_serves_several_buses_and_says_where(tmp_path):
    arguments = ("--modbus-tcp", "127.0.0.1:0", "--modbus-rtu", "pty", "--json", "--seed", "5")
    more = ("--option", "command=200", "--kinematics", "Kin_Gantry3+Kin_CAxis")
    with served(*arguments, *more, "--state", str(tmp_path / "plc.json")) as (process, line):
        document = json.loads(line)
        assert (document["schema"], document["simulated"]) == ("robolink/sim/1", True)
        assert document["url"] == document["urls"]["modbus-tcp"]
        assert (document["kinematics"], document["seed"]) == ("Kin_Gantry3+Kin_CAxis", 5)
        for url in document["urls"].values():
            with closing(open_mailbox_link(url)) as link:
                MailboxClient(link).take(insist=1)
        with AssistClient(document["assist"]) as assist:
            assert "1" in assist.truth()["tips"]
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=20) == 0
    assert json.loads((tmp_path / "plc.json").read_text())["memory"]["epoch"] == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--option", "colour=red"), "no option 'colour'"),
        (("--param", "dArmLength1"), "NAME=VALUE"),
        (("--modbus-tcp", "0.0.0.0:0"), "other machines"),
        (("--can", "udp_multicast"), "names no CAN bus"),
    ],
)
def test_a_mistake_is_said_and_exits_with_2(arguments, words, capsys):
    assert main.run(["sim", "softmotion", *arguments]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert words in shown.err
