"""A command line for the tests, separated from the tester's passwords and settings."""

import os
from itertools import count

import click
import pytest
from robolink_cli import lazy_group, main
from robolink_cli.console import render
from robolink_cli.options.shared import json_option
from robolink_cli.session.context import controller_options
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

from tests._documents import DOCUMENTS

_numbers = count()


@pytest.fixture(autouse=True)
def plain_environment(monkeypatch, tmp_path):
    for name in [name for name in os.environ if name.startswith(("ROBOLINK", "_ROBOLINK"))]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


@pytest.fixture
def command(monkeypatch):
    """Replace ``status`` by a command of the test's own, and add one for ``sim``."""
    DOCUMENTS.forgive()  # the documents of these tests' commands are made up
    seen = []

    def install(act=lambda context: None):
        @click.command("status")
        @controller_options
        def status(context):
            seen.append(context)
            return act(context)

        @click.command("sim")
        @json_option
        def sim():
            render.say("serving")

        own = {"status": status, "sim": sim}
        monkeypatch.setattr(
            lazy_group.LazyGroup, "get_command", lambda self, context, name: own.get(name)
        )
        return seen

    return install


@pytest.fixture
def state_folder(tmp_path, monkeypatch):
    """The test's own state folder and working folder; returns the first."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "state"


@pytest.fixture
def simulator(state_folder):
    """A simulated controller that is recorded like a real one.

    No file keeps its tools: no test reads that file, and writing it costs a fifth of a command's
    time.
    """
    simulator = EpsonSimulator(seed=4, serial="SIM00001")
    simulator.durable = True
    name = f"cli-{next(_numbers)}"
    register(name, simulator)
    yield simulator
    unregister(name)


@pytest.fixture
def run(simulator, capsys):
    """Run a command on the simulator; return the exit code and the output."""

    def ran(*arguments):
        code = main.run(["-c", simulator.url, *arguments])
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return ran


@pytest.fixture
def golden(run):
    """The name of a backup of the controller in its initial state."""
    assert run("backup", "golden.json")[0] == 0
    return "golden.json"
