"""``--wait SECONDS`` waits for another program that has the controller locked."""

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process import epson, softmotion
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink import ANY, ToolOffset, runtime
from robolink.journal import memory_journal
from robolink.model import new_operation
from tests._meanwhile import Meanwhile

NEW = ["tool", "set", "2", "--x", "5", "--y", "6", "--z", "-70"]


def other_program(url):
    """Return the controller of a second program, which works on it with its own journal."""
    other = robolink.connect(url, outcomes=memory_journal(new_operation()).log(url))
    other.tools.write(3, ToolOffset(1.0, 2.0, -3.0), expected=ANY)
    return other


@pytest.fixture(params=["epson", "softmotion"])
def url(request):
    where, kind = {
        "epson": (epson, EpsonSimulator),
        "softmotion": (softmotion, SoftMotionSimulator),
    }[request.param]
    name = new_operation()
    where.register(name, kind(seed=3))
    yield f"{request.param}+sim://{name}"
    where.unregister(name)


def test_a_tool_is_set_when_the_other_program_has_ended(url, state_folder, capsys):
    other = other_program(url)
    line = ["-c", url, "--timeout", "0.1", *NEW]
    code = main.run(line)
    said = capsys.readouterr().err
    assert code in (3, 5)
    assert "--wait" in said or "PLC" in said
    with runtime.replaced(Meanwhile(other.close)):
        assert main.run([*line, "--wait", "20"]) == 0
    said = capsys.readouterr().err
    assert "Waiting for up to 20 s." in said
    with robolink.connect(url) as controller:
        now = controller.tools.read(2)
    assert now is not None
    assert now.components()[:3] == (5, 6, -70)


def test_the_wait_ends(url, state_folder, capsys):
    time = Meanwhile()
    with other_program(url), runtime.replaced(time):
        assert main.run(["-c", url, "--timeout", "0.1", *NEW, "--wait", "3"]) in (3, 5)
    assert 2.9 <= time.slept_s <= 3.2
    assert capsys.readouterr().err.count("Waiting for up to 3 s.") == 1


@pytest.mark.parametrize("given", ["-1", "nan", "1e9"])
def test_no_other_wait_is_taken(state_folder, given, capsys):
    assert main.run(["-c", "epson+sim://no-wait", *NEW, "--wait", given]) == 2
    said = capsys.readouterr().err
    assert "--wait" in said or "A wait of" in said
