"""sim --faults: what is planned happens to any client, and each time it is told."""

import json
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import click
import pytest
from robolink_cli import main
from robolink_cli.commands.simulate.simulated_kind import plan_faults
from robolink_cli.console.render import switch_json_on
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.faults import LinkKind
from robolink_simulators.hosting.in_process.epson import register

from robolink.timing import NS_PER_S

LOST = """
schema = "robolink/faults/1"
link = "{link}"
[[fault]]
action = "{action}"
match = "{match}"
"""


@pytest.fixture
def plan(tmp_path):
    def write(link, action, match=""):
        path = tmp_path / "plan.toml"
        path.write_text(LOST.format(link=link, action=action, match=match), encoding="utf-8")
        return str(path)

    return write


@contextmanager
def in_this_process(path, capsys):
    """A simulator with the plan; its URL, and what returns the next line that it told."""
    simulator = EpsonSimulator()
    simulator.advance(NS_PER_S)
    with click.Context(click.Command("sim")) as context:
        switch_json_on(context)
        plan_faults(simulator, Path(path), {LinkKind.EPSON_TCP})
    # Its client waits in simulated time: an answer that comes is never late, however busy this is.
    yield register("planned-faults", simulator), lambda: capsys.readouterr().out


@contextmanager
def by_command(path, _capsys):
    """The same of ``robolink sim`` in a process of its own."""
    arguments = ["sim", "epson", "--tcp", "127.0.0.1:0", "--faults", path]
    paths = os.pathsep.join(path for path in sys.path if path)
    with subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", "--json", *arguments],
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        text=True,
    ) as served:
        assert served.stdout is not None
        try:
            yield json.loads(served.stdout.readline())["url"], served.stdout.readline
        finally:
            served.terminate()
        assert served.wait(timeout=20) == 0


@pytest.mark.parametrize(
    "served", [in_this_process, pytest.param(by_command, marks=pytest.mark.soak)]
)
def test_a_lost_answer_is_told_by_the_simulator_and_ends_the_client_in_doubt(
    state_folder, capsys, plan, served
):
    path = plan("epson+tcp", "drop_reply", "TLSet 2, XY")
    with served(path, capsys) as (url, told):
        tool = ["tool", "set", "2", "--x", "10", "--y", "0", "--z", "-50"]
        assert main.run(["-c", url, "--timeout", "10", *tool]) == 6
        document = json.loads(next(line for line in told().splitlines() if line[0] == "{"))
    assert document["schema"] == "robolink/fault/1"
    assert document["fault"] == {"action": "drop_reply", "match": "TLSet 2, XY"}
    assert document["request"].startswith('$Execute,"TLSet 2, XY(10')
    assert document["simulated_s"] > 0


def test_a_person_is_told_in_words(capsys, plan):
    simulator = EpsonSimulator()
    plan_faults(simulator, Path(plan("epson+tcp", "drop_reply")), {LinkKind.EPSON_TCP})
    simulator.connect(0).receive(b"$Login,secret\r\n", 0)
    assert capsys.readouterr().out == "FAULT drop_reply: $Login,***\n"


@pytest.mark.parametrize(
    ("command", "link", "action", "told"),
    [
        (["epson"], "softmotion+can", "echo", "echo cannot happen on epson+tcp"),
        (["epson"], "softmotion+can", "drop_reply", 'Write link = "epson+tcp" in the plan'),
        (["softmotion"], "softmotion+can", "echo", "echo cannot happen on softmotion+modbus-tcp"),
        (["softmotion"], "epson+tcp", "lose_login", "lose_login cannot happen on softmotion"),
        (
            ["epson"],
            "epson+tcp",
            "drop_replay",
            "line 5, fault 1, action: is not known",
        ),
    ],
)
def test_what_cannot_happen_is_refused_before_anything_is_served(
    state_folder, capsys, plan, command, link, action, told
):
    assert main.run(["sim", *command, "--faults", plan(link, action)]) == 2
    assert told in capsys.readouterr().err
