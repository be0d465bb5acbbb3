"""A served simulator leaves nothing behind for the next one, seen from outside."""

import json
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

import robolink
from robolink import ToolOffset
from robolink.controllers import PlcMapController
from robolink.errors import OutcomeUnknownError
from robolink.testing import confirm_whole_map
from tests._ports import free_port

LOST = 'schema = "robolink/faults/1"\nlink = "{link}"\n[[fault]]\naction = "drop_reply"\n'


@contextmanager
def served(*arguments):
    paths = os.pathsep.join(path for path in sys.path if path)
    process = subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", "--json", "sim", *arguments],
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    with process, process.stdout:
        try:
            yield json.loads(process.stdout.readline())
        finally:
            process.terminate()


def compare_the_map(controller):
    """Record that a map was compared: nothing is written through it before."""
    if isinstance(controller, PlcMapController):
        confirm_whole_map(controller)


def lose_an_answer(document):
    """Write a tool whose answer is lost; return the controller's identity."""
    with robolink.connect(document["url"], timeout_s=3.0) as controller:
        compare_the_map(controller)
        with pytest.raises(OutcomeUnknownError):
            controller.tools.write(2, ToolOffset(1, 2, 3), expected=robolink.ANY)
        assert controller.outcomes.open_markers()
        return controller.outcomes.identity


def starts_clean(document):
    with robolink.connect(document["url"]) as controller:
        compare_the_map(controller)
        assert not controller.outcomes.open_markers()
        controller.tools.write(2, ToolOffset(1, 2, 3), expected=robolink.ANY)
        return controller.outcomes.identity


# On the same port, with the same seed, one after the other.
KINDS = [
    pytest.param("epson", "epson+tcp", "TLSet 2, XY", "--tcp", id="epson"),
    pytest.param(
        *("softmotion", "softmotion+modbus-tcp", "WRITE_TOOL", "--modbus-tcp"),
        marks=pytest.mark.soak,
        id="softmotion",
    ),
]


@pytest.mark.parametrize(("kind", "link", "match", "at"), KINDS)
def test_the_next_simulator_on_the_port_starts_clean(kind, link, match, at, tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "own"))
    plan = tmp_path / "lost.toml"
    plan.write_text(f'{LOST.format(link=link)}match = "{match}"\n')
    common = (kind, at, f"127.0.0.1:{free_port()}", "--seed", "7")
    with served(*common, "--faults", str(plan)) as first:
        one = lose_an_answer(first)
        assert Path(first["state_dir"]).is_dir()
    with served(*common) as second:
        assert first["url"] == second["url"]
        assert starts_clean(second) != one
    assert not Path(first["state_dir"]).exists()


@pytest.mark.soak
def test_a_machine_without_a_number_is_told_apart_by_the_folder(tmp_path, monkeypatch):
    """A PLC with a map is known by its address: the folder of each run keeps runs apart."""
    own = tmp_path / "own"
    own.mkdir()
    (own / "journal.db").write_bytes(b"precious")
    plan = tmp_path / "lost.toml"
    plan.write_text(f'{LOST.format(link="plc+modbus-tcp")}match = "fc5 2000"\n')
    example = Path(__file__).parents[2] / "examples/plc-maps/commit-bit.toml"
    common = ("plc", "--map", str(example), "--modbus-tcp", f"127.0.0.1:{free_port()}")
    with served(*common, "--faults", str(plan)) as first:
        monkeypatch.setenv("ROBOLINK_STATE_DIR", first["state_dir"])
        one = lose_an_answer(first)
    with served(*common) as second:
        monkeypatch.setenv("ROBOLINK_STATE_DIR", second["state_dir"])
        assert starts_clean(second) == one
    assert [path.name for path in own.iterdir()] == ["journal.db"]
    assert (own / "journal.db").read_bytes() == b"precious"
