"""``robolink sim epson`` in a process of its own."""

import json
import os
import select
import signal
import socket
import subprocess
import sys
from contextlib import closing, contextmanager

import pytest
from robolink_cli import main
from robolink_simulators.control.assist import AssistClient

from robolink.timing import Deadline
from robolink.transport import open_transport

ARGUMENTS = ("sim", "epson", "--tcp", "127.0.0.1:0")


def environment(**extra):
    paths = os.pathsep.join(path for path in sys.path if path)
    return {**os.environ, "PYTHONPATH": paths, **extra}


def run(*arguments, **extra):
    return subprocess.run(
        [sys.executable, "-m", "robolink_cli", *arguments],
        env=environment(**extra),
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )


@contextmanager
def started(*arguments, **extra):
    process = subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", *ARGUMENTS, *arguments],
        env=environment(**extra),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def first_line(process):
    assert process.stdout is not None
    readable, _, _ = select.select([process.stdout], [], [], 20)
    assert readable, "nothing was printed"
    return process.stdout.readline()


def ask(url, *requests):
    answers = []
    with closing(open_transport(url)) as transport:
        for request in requests:
            deadline = Deadline.after(transport.clock, 5)
            transport.send(request.encode() + b"\r\n", deadline=deadline)
            answers.append(transport.receive(deadline=deadline).decode().rstrip())
    return answers


def test_the_first_line_says_where_it_is_and_sigterm_ends_it_well():
    with started("--json", "--seed", "5", "--robot", "GX4-C251S") as process:
        document = json.loads(first_line(process))
        assert document["schema"] == "robolink/sim/1"
        assert document["simulated"] is True
        assert (document["robot"], document["seed"]) == ("GX4-C251S", 5)
        assert ask(document["url"], "$Login,", "$GetRobotInfo") == [
            "#Login,0",
            "#GetRobotInfo,1,3,GX4-C251S",
        ]
        with AssistClient(document["assist"]) as assist:
            assert "1" in assist.truth()["tips"]
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=20) == 0


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGHUP, 129)])
def test_a_person_reads_that_it_is_simulated_and_may_press_ctrl_c_or_close_the_window(number, code):
    with started() as process:
        assert "SIMULATED" in first_line(process)
        process.send_signal(number)
        assert process.wait(timeout=20) == code


def test_options_password_and_state_reach_the_simulator(tmp_path):
    state = tmp_path / "cell.json"
    arguments = (
        *("--json", "--option", "status_flags=10", "--option", "numbers.tool_undefined=4321"),
        *("--password-env", "CELL_PASSWORD", "--state", str(state), "--speed", "50"),
    )
    with started(*arguments, CELL_PASSWORD="s3cret") as process:
        url = json.loads(first_line(process))["url"]
        answers = ask(
            url,
            "$Login,wrong",
            "$Login,s3cret",
            '$Execute,"TLSet 2, XY(1,2,3,4)"',
            '$Execute,"Tool 9"',
            "$GetStatus",
        )
    assert answers == [
        "!Login,13",
        "#Login,0",
        "#Execute,0",
        "!Execute,99",
        "#GetStatus,0100001001,4321",
    ]
    assert "offsets" in json.loads(state.read_text())["tools"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--option", "colour=red"), "no option 'colour'"),
        (("--option", "terminator"), "NAME=VALUE"),
        (("--option", "terminator=tab"), "cannot be 'tab'"),
        (("--robot", "R2D2"), "no simulated robot"),
        (("--tcp", "0.0.0.0:0"), "other machines"),
        (("--tcp", "127.0.0.1"), "not an address"),
        (("--tcp", "127.0.0.1:70000"), "not an address"),
        (("--password-env", "NOT_SET_ANYWHERE"), "holds no password"),
    ],
)
def test_a_mistake_is_said_and_exits_with_2(arguments, words, capsys):
    assert main.run(["sim", "epson", *arguments]) == 2
    shown = capsys.readouterr()
    assert words in shown.err
    assert shown.out == ""


def test_a_taken_port_exits_with_3():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        done = run("sim", "epson", "--tcp", f"127.0.0.1:{port}")
    assert done.returncode == 3
    assert str(port) in done.stderr
