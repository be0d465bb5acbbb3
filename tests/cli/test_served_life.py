"""The conditions under which a served simulator ends by itself."""

import errno
import json
import os
import signal
import subprocess
import sys
from itertools import count
from time import monotonic

import pytest
from robolink_cli import main
from robolink_cli.commands.simulate.service import ParentWatch, Termination
from robolink_cli.options.simulation import ServedLife
from robolink_simulators.control.assist import AssistClient
from robolink_simulators.control.client import ControlClient

import robolink
from robolink.errors import RobolinkError


def waited(life, requests=int):
    """Return the life time of a simulator."""
    began = monotonic()
    with Termination(life) as stopped:
        stopped.wait(requests)
        assert not stopped.came
    return monotonic() - began


def test_it_ends_when_nobody_has_asked_for_so_long():
    life = ServedLife("", with_parent=False, idle_exit_s=0.2)
    assert waited(life) >= 0.2
    asked = count()
    looked = []

    def requests():
        looked.append(min(next(asked), 12))
        return looked[-1]

    # A client asks between the first twelve looks, and nobody afterwards.
    assert waited(life, requests) >= 0.2 + 11 * 0.2 / 4
    assert looked.count(12) >= 4


def test_a_folder_that_a_client_still_uses_fails_no_end(monkeypatch):
    def used(path, **_):
        raise OSError(errno.EBUSY, os.strerror(errno.EBUSY), path)

    with monkeypatch.context() as patched:
        with Termination() as stopped:
            patched.setattr(os, "rmdir", used)
    os.rmdir(stopped.state_dir)


@pytest.mark.skipif(os.name == "nt", reason="Windows does not tell that a parent has ended")
@pytest.mark.parametrize("handles", [True, False])
def test_a_parent_that_was_killed_has_ended_before_anybody_has_waited_for_it(handles, monkeypatch):
    parent = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    if not handles:
        monkeypatch.delattr(os, "pidfd_open", raising=False)
    watch = ParentWatch(parent.pid)
    assert not watch.ended()
    parent.kill()
    if not handles:
        parent.wait()  # there it counts as ended only then
    began = monotonic()
    while not watch.ended():
        assert monotonic() - began < 10
    watch.close()
    parent.communicate()
    assert ParentWatch(parent.pid).ended()  # and a late client sees it at once


SPAWNS = """
import json, subprocess, sys
served = subprocess.Popen(
    [sys.executable, "-m", "robolink_cli", "--json", "sim", "epson", "--tcp", "127.0.0.1:0",
     "--with-parent"],
    stdout=subprocess.PIPE, text=True)
json.loads(served.stdout.readline())
print(json.dumps({"simulator": served.pid}), flush=True)
"""


@pytest.mark.soak
@pytest.mark.skipif(os.name == "nt", reason="Windows does not tell that a parent has ended")
def test_it_ends_with_the_process_that_started_it():
    paths = os.pathsep.join(path for path in sys.path if path)
    done = subprocess.run(
        [sys.executable, "-c", SPAWNS],
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        text=True,
        timeout=60,
        check=True,
    )
    simulator = json.loads(done.stdout)["simulator"]
    began = monotonic()
    while monotonic() - began < 30:
        try:
            os.kill(simulator, 0)
        except ProcessLookupError:
            return
        # Its own look comes every half second; ours need not be finer.
        subprocess.run(["sleep", "0.2"], check=True)
    os.kill(simulator, signal.SIGTERM)
    pytest.fail("it lives on")


FILE = """
schema = "robolink/sim-cells/1"
[cells.a]
kind = "epson"
tcp = "127.0.0.1:0"
assist = true
[cells.b]
kind = "softmotion"
tcp = "127.0.0.1:0"
assist = true
"""


@pytest.mark.parametrize(
    "what",
    [
        ("sim", "epson", "--tcp", "127.0.0.1:0"),
        ("sim", "softmotion", "--modbus-tcp", "127.0.0.1:0"),
        ("sim", "run"),
    ],
    ids=["epson", "softmotion", "a file"],
)
def test_whatever_is_asked_at_any_of_its_ports_keeps_it_alive(what, tmp_path, monkeypatch, capsys):
    """A use of each port raises the count that ``--idle-exit`` reads."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    if what == ("sim", "run"):
        path = tmp_path / "cells.toml"
        path.write_text(FILE)
        what = (*what, str(path))
    used = []

    def wait(_, requests, _failure):
        document = json.loads(capsys.readouterr().out)
        for cell in document.get("cells", {"": document}).values():
            for use, url in ((look, cell["assist"]), (ask, cell["control"]), (read, cell["url"])):
                before = requests()
                use(url)
                assert requests() > before, url
                used.append(use)

    monkeypatch.setattr(Termination, "wait", wait)
    assert main.run([*what, "--idle-exit", "60", "--json"]) == 0, capsys.readouterr().err
    assert len(used) == 3 * (2 if what[1] == "run" else 1)


@pytest.mark.parametrize(
    "what",
    [(*of, kind) for of in (("sim",), ("sim", "run")) for kind in ("epson", "softmotion")],
    ids=" ".join,
)
def test_one_that_can_keep_its_state_no_longer_says_so_and_ends(
    what, tmp_path, monkeypatch, capsys
):
    """A full disk or a missing folder: no traceback, and no test that goes on."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "records"))
    kept = tmp_path / "kept/state.json"
    arguments = [*what, "--tcp", "127.0.0.1:0", "--state", str(kept)]
    if what[1] == "run":
        path = tmp_path / "cells.toml"
        path.write_text(
            'schema = "robolink/sim-cells/1"\n'
            f'[cells.a]\nkind = "{what[2]}"\ntcp = "127.0.0.1:0"\nstate = "kept/state.json"\n'
        )
        arguments = ["sim", "run", str(path)]
    waited_before = Termination.wait

    def wait(self, requests, failure):
        document = json.loads(capsys.readouterr().out)
        (cell,) = document.get("cells", {"": document}).values()
        kept.unlink()
        kept.parent.rmdir()
        kept.parent.write_text("in its place")
        with pytest.raises(RobolinkError), robolink.connect(cell["url"]) as controller:
            controller.tools.write(2, robolink.ToolOffset(1, 2, 3), expected=None)
        waited_before(self, requests, failure)

    monkeypatch.setattr(Termination, "wait", wait)
    assert main.run([*arguments, "--json"]) == 2
    told = capsys.readouterr()
    error = json.loads(told.out)["error"]
    assert "cannot save its state" in error["what"]
    assert str(kept) in error["what"]
    assert error["what"].startswith("The simulated cell a cannot run:") == (what[1] == "run")
    assert error["remedy"]
    assert "Traceback" not in told.err


def look(url):
    with AssistClient(url) as client:
        client.look()


def ask(url):
    with ControlClient(url) as client:
        client.about()


def read(url):
    with robolink.connect(url, timeout_s=10) as controller:
        controller.tools.read(1)
