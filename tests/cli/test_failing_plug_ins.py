"""What an installed package of another maker lets out is told as its own, not as robolink's."""

import json
import sys

import pytest
from robolink_cli import main
from robolink_cli.console import exit_codes

from robolink.plug_ins import plug_in_module

DRIVER = """
from robolink.testing import MemoryController, MemoryMachine
from acme_vendor.wire import ask

class Machine(MemoryMachine):
    def read(self, tool):
        return ask({"tool": tool})

def opener(url, terms):
    return MemoryController(Machine(), identity="acme+tcp://1")
"""

VENDOR = """
def ask(words):
    return words["dongle"]
"""

ENTRY = "[robolink.controllers]\nacme+tcp = acme_robots.driver:opener\n"


@pytest.fixture
def acme(monkeypatch, tmp_path):
    """A driver as pip installs it, which calls a library of its maker that fails."""
    for folder, module, content in (
        ("acme_robots", "driver", DRIVER),
        ("acme_vendor", "wire", VENDOR),
    ):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "__init__.py").touch()
        (tmp_path / folder / f"{module}.py").write_text(content)
    info = tmp_path / "acme_robots-2.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: acme-robots\nVersion: 2.1\n")
    (info / "entry_points.txt").write_text(ENTRY)
    monkeypatch.syspath_prepend(tmp_path)
    yield "acme+tcp://127.0.0.1:1"
    for name in [name for name in sys.modules if name.startswith("acme_")]:
        del sys.modules[name]


def test_it_is_named_with_its_package_and_ends_with_2(acme, capsys):
    code = main.run(["-c", acme, "tool", "get", "3", "--json"])
    document = json.loads(capsys.readouterr().out)
    error = document["error"]
    assert (code, document["exit_code"], error["kind"]) == (2, 2, "KeyError")
    assert error["what"] == (
        "acme_robots.driver, of the installed package acme-robots 2.1, failed: KeyError: 'dongle'"
    )
    assert error["remedy"].endswith("report it to whoever made acme-robots 2.1.")


def test_the_traceback_shows_where(acme, capsys, monkeypatch):
    monkeypatch.setenv("ROBOLINK_DEBUG", "1")
    assert main.run(["-c", acme, "tool", "get", "3"]) == 2
    shown = capsys.readouterr().err
    assert 'return words["dongle"]' in shown
    assert "A defect in robolink" not in shown


def test_what_no_plug_in_let_out_stays_a_defect(acme, command, capsys):
    command(lambda _context: json.loads("{"))  # a library fails, and robolink called it
    assert main.run(["-c", acme, "status"]) == exit_codes.BUG
    assert "A defect in robolink: JSONDecodeError" in capsys.readouterr().err


def test_what_robolink_lets_out_below_a_plug_in_is_its_own(acme):
    def callback(namespace):
        exec("def run(act): return act()", namespace)
        return namespace["run"]

    def failing():
        exec("raise KeyError('ours')", {"__name__": "robolink.model"})

    with pytest.raises(KeyError) as raised:
        callback({"__name__": "acme_robots.driver"})(failing)
    # The last frame of all is robolink's.
    assert plug_in_module(raised.value) is None
