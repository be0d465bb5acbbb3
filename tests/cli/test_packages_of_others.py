"""Third-party packages and other versions are named, whatever error they cause."""

import json
import os
import subprocess
import sys
from importlib import metadata

import pytest
from robolink_cli import main
from robolink_cli.console import exit_codes

from robolink.plug_ins import plug_in_module
from tests._documents import wrong_in

# An error of an installed third-party package is reported as its own, not as robolink's.

DRIVER = """
from robolink.controllers import SimpleController, SimpleMachine
from acme_vendor.wire import ask

class Machine(SimpleMachine):
    def read(self, tool):
        return ask({"tool": tool})

def opener(url, terms):
    return SimpleController(Machine(), identity="acme+tcp://1")
"""

VENDOR = """
def ask(words):
    return words["dongle"]
"""

ENTRY = "[robolink.controllers]\nacme+tcp = acme_robots.driver:opener\n"


@pytest.fixture
def acme(monkeypatch, tmp_path):
    """A driver as pip installs it, which calls a failing library of its maker."""
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
    assert error["remedy"].endswith("then tell the makers of acme-robots 2.1.")


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


# A package of an unsupported version is named, whatever error it causes.
# The packages put before this machine's are as pip leaves them: files, and metadata with a version.

BREAKS = "raise ImportError('no such thing in this version')"


CELL = '[cells.a]\nurl = "epson+tcp://192.0.2.1:5000"\n'


def soak(name):
    return pytest.param(name, marks=pytest.mark.soak)


@pytest.fixture
def instead(tmp_path):
    """Run a command with another version of a package first in the path."""

    def run(name, version, content, *command):
        (tmp_path / "robolink.toml").write_text(CELL)
        package = tmp_path / name
        package.mkdir()
        (package / "__init__.py").write_text(content)
        info = tmp_path / f"{name}-{version}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        return subprocess.run(
            [sys.executable, "-m", "robolink_cli", *command],
            cwd=tmp_path,
            env=os.environ
            | {"PYTHONPATH": str(tmp_path), "ROBOLINK_STATE_DIR": str(tmp_path / "state")},
            capture_output=True,
            text=True,
            timeout=50,
            check=False,
        )

    return run


@pytest.mark.parametrize("name", [soak("click"), soak("pydantic"), "rich"])
def test_doctor_names_what_is_there_and_what_is_needed(instead, name):
    done = instead(name, "1.0.3", BREAKS, "doctor")
    assert done.returncode == 1, done.stderr
    first = done.stdout.splitlines()[0]
    assert first.startswith(f"bad   {name}: 1.0.3 is installed, ")
    assert first.endswith(" is needed.")
    assert "\nok    python: " in done.stdout
    assert done.stdout.endswith("Problems were found; see the first lines.\n")


def test_doctor_without_click_speaks_json_too(instead):
    done = instead("click", "1.0.3", BREAKS, "doctor", "--json")
    assert done.returncode == 1, done.stderr
    document = json.loads(done.stdout)
    assert (document["schema"], document["healthy"]) == ("robolink/doctor/1", False)
    assert wrong_in(document) == []
    first = document["checks"][0]
    assert (first["subject"], first["level"]) == ("click", "bad")


@pytest.mark.parametrize("name", [soak("click"), "pydantic"])
def test_a_command_that_such_a_package_breaks_is_no_defect(instead, name):
    done = instead(name, "1.0.3", BREAKS, "cell", "list", "--json")
    assert done.returncode == 2, done.stdout
    document = json.loads(done.stdout)
    assert wrong_in(document) == []
    assert document["exit_code"] == 2
    assert f"{name}: 1.0.3 is installed" in document["error"]["what"]
    assert "no such thing in this version" in document["error"]["what"]
    assert f"python -m pip install '{name}" in document["error"]["what"]


def test_where_every_package_fits_a_failure_stays_a_defect(instead):
    done = instead("pydantic", metadata.version("pydantic"), BREAKS, "cell", "list")
    assert done.returncode == 70, done.stdout
    assert "A defect in robolink: ImportError: no such thing in this version" in done.stderr
    done = instead("click", metadata.version("click"), BREAKS, "cell", "list")
    assert "ImportError: no such thing in this version" in done.stderr
