"""A simulator that runs on Windows, and a client on Linux that uses it over TCP."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.windows._windows_python import WindowsPython

Client = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def served(windows: WindowsPython, state: dict[str, str]) -> Iterator[dict[str, Any]]:
    """A simulated EPSON controller on Windows, with its printed output."""
    command = ("-m", "robolink_cli", "--json", "sim", "epson", "--tcp", "127.0.0.1:0")
    process = windows.start(*command, "--seed", "7", **state)
    try:
        assert process.stdout is not None
        yield json.loads(process.stdout.readline())
    finally:
        process.terminate()
        process.communicate(timeout=60)


@pytest.fixture
def client(served, tmp_path, monkeypatch) -> Client:
    """The command line of this machine, for the simulator on Windows."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "linux"))

    def run(*arguments: str) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            [sys.executable, "-m", "robolink_cli", "-c", served["url"], *arguments],
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
            stdin=subprocess.DEVNULL,
        )

    return run


def test_a_tool_is_written_and_read_back(client):
    written = client("tool", "set", "5", "--x", "1.5", "--y", "-2", "--z", "-30")
    assert written.returncode == 0, written.stderr
    read = json.loads(client("--json", "tool", "get", "5").stdout)
    assert (read["offset"]["x_mm"], read["offset"]["y_mm"]) == (1.5, -2)


def test_a_needle_is_calibrated_by_the_simulated_operator(client, served):
    assert client("robot", "motors", "on", "--yes").returncode == 0
    before = client("tool", "get", "1").stdout
    done = client("calibrate", "two-pose", "--tool", "1", "--assist", served["assist"], "--yes")
    assert done.returncode == 0, done.stdout + done.stderr
    assert client("tool", "get", "1").stdout != before
