"""doctor finds each obstacle and changes nothing."""

import json
import os
import sys
from importlib import metadata
from types import ModuleType, SimpleNamespace

import pytest
from robolink_cli import main
from robolink_cli.commands.computer import checkup
from robolink_cli.commands.computer.checkup import (
    Level,
    check_name,
    check_versions,
    fits,
    requirement,
)

from robolink.journal import open_journal
from robolink.model import Marker, MarkerKind

IDENTITY = "epson+tcp://192.0.2.1:5000"


@pytest.fixture(autouse=True)
def a_healthy_computer(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    for place in ("user", "site"):
        monkeypatch.setattr(f"platformdirs.{place}_config_path", lambda *a, **k: tmp_path / "none")
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    install(monkeypatch, {"robolink": "0.1.0", "click": "8.5.1"}, ["click<9,>=8.1"])


def install(monkeypatch, versions, requires, python=">=3.11"):
    """Pretend that these packages are installed."""

    def version(name):
        if name not in versions:
            raise metadata.PackageNotFoundError(name)
        return versions[name]

    def distribution(name):
        version(name)
        return SimpleNamespace(metadata={"Requires-Python": python}, requires=requires)

    monkeypatch.setattr(metadata, "version", version)
    monkeypatch.setattr(metadata, "distribution", distribution)


def levels(remarks):
    return [(remark.subject, remark.level) for remark in remarks]


def test_what_only_developers_install_is_not_named(monkeypatch):
    requires = ["sphinx<10,>=9; extra == 'docs'", "mypy; extra == 'dev'", "psycopg; extra == 'pg'"]
    install(monkeypatch, {"robolink": "0.1.0"}, requires)
    assert levels(check_versions())[1:] == [("psycopg", Level.OK)]


def test_a_healthy_computer_is_told_so(capsys, tmp_path):
    assert main.run(["doctor", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["healthy"]
    found = {check["subject"]: check["level"] for check in document["checks"]}
    assert set(found) == {
        *("python", "click", "name", "state", "cells", "keyring", "serial", "journal")
    }
    assert set(found.values()) == {"ok"}
    assert main.run(["doctor"]) == 0
    shown = capsys.readouterr().out
    assert "ok    click: 8.5.1\n" in shown
    assert shown.endswith("No problem was found.\n")
    assert list(tmp_path.iterdir()) == []


def test_something_bad_ends_with_one_and_says_what_to_do(capsys, monkeypatch):
    install(monkeypatch, {"robolink": "0.1.0", "click": "7.1"}, ["click<9,>=8.1"])
    assert main.run(["doctor"]) == 1
    shown = capsys.readouterr().out
    assert "bad   click: 7.1 is installed, <9,>=8.1 is needed.\n" in shown
    assert "      Run: python -m pip install 'click<9,>=8.1'\n" in shown
    assert main.run(["doctor", "--json"]) == 1
    assert not json.loads(capsys.readouterr().out)["healthy"]


@pytest.mark.parametrize(
    ("version", "level"), [(None, Level.BAD), ("9.0", Level.BAD), ("8.1", Level.OK)]
)
def test_a_dependency_is_compared_with_what_is_asked_for(monkeypatch, version, level):
    versions = {"robolink": "0.1.0"} | ({"click": version} if version else {})
    install(monkeypatch, versions, ["click<9,>=8.1", 'pytest>=8; extra == "dev"'])
    assert levels(check_versions()) == [("python", Level.OK), ("click", level)]


@pytest.mark.parametrize(
    ("version", "level"), [(None, Level.OK), ("20", Level.WARN), ("25.7.0", Level.OK)]
)
def test_an_optional_dependency_may_be_missing(monkeypatch, version, level):
    versions = {"robolink": "0.1.0"} | ({"keyring": version} if version else {})
    install(monkeypatch, versions, ['keyring>=25; extra == "keyring"'])
    assert levels(check_versions())[1:] == [("keyring", level)]


def test_an_old_python_is_bad(monkeypatch):
    install(monkeypatch, {"robolink": "0.1.0"}, [], python=">=4")
    assert levels(check_versions()) == [("python", Level.BAD)]


def test_a_robolink_that_is_not_installed_is_told(monkeypatch):
    install(monkeypatch, {}, [])
    assert levels(check_versions()) == [("robolink", Level.WARN)]


@pytest.mark.parametrize(
    ("version", "versions", "expected"),
    [
        ("8.5.1", ">=8.1,<9", True),
        ("8.0.9", ">=8.1,<9", False),
        ("9.0.0", ">=8.1, <9", False),
        ("4.14.5", ">=4", True),
        ("3.16.1", "!=3.16.1", False),
        ("8", "==8.0", True),
        ("8.1rc1", "<=8.1", True),
        ("2", ">1.9", True),
        ("1", "", True),
    ],
)
def test_versions_are_compared_by_their_numbers(version, versions, expected):
    assert fits(version, versions) is expected


@pytest.mark.parametrize("versions", ["~=1.1", "===1", "newest"])
def test_a_range_that_cannot_be_read_is_a_defect_and_no_guess(versions):
    with pytest.raises(ValueError, match=versions):
        fits("1", versions)


def test_every_requirement_of_this_package_can_be_read(monkeypatch):
    monkeypatch.undo()
    lines = metadata.requires("robolink")
    assert lines
    for line in lines:
        wanted = requirement(line)
        assert fits("0", wanted.versions) is False


def test_a_requirement_with_another_condition_is_a_defect():
    assert requirement('keyring>=25; extra == "keyring"').extra == "keyring"
    with pytest.raises(ValueError, match="win32"):
        requirement("colorama>=1; sys_platform == 'win32'")


@pytest.mark.parametrize(
    ("listed", "content"),
    [
        ("top_level.txt", "robodk\nrobolink\n"),
        ("RECORD", "robodk/__init__.py,,\nrobolink/__init__.py,sha256=x,1\n"),
        ("RECORD", "robolink.py,,\n"),
    ],
)
def test_another_package_that_brings_a_robolink_is_bad(monkeypatch, tmp_path, listed, content):
    info = tmp_path / "robodk-5.6.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: robodk\nVersion: 5.6\n")
    (info / listed).write_text(content)
    monkeypatch.syspath_prepend(tmp_path)
    (remark,) = check_name()
    assert remark.level is Level.BAD
    assert "robodk" in remark.what
    assert "uninstall robodk" in remark.remedy


@pytest.mark.parametrize("name", ["robolink.py", "robolink/__init__.py"])
def test_another_robolink_on_the_import_path_is_named(monkeypatch, tmp_path, name):
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).touch()
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    (remark,) = check_name()
    assert remark.level is Level.WARN
    assert str(tmp_path / "robolink") in remark.what


def test_a_state_folder_that_cannot_be_made_is_bad(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "file" / "state"))
    (remark,) = checkup.check_state_folder()
    assert remark.level is Level.BAD
    assert "ROBOLINK_STATE_DIR" in remark.remedy


def test_a_state_folder_that_is_read_only_is_bad(monkeypatch):
    monkeypatch.setattr(os, "access", lambda *arguments: False)
    assert levels(checkup.check_state_folder()) == [("state", Level.BAD)]


def test_a_state_folder_that_others_may_change_is_told(tmp_path):
    folder = tmp_path / "state" / "backups"
    folder.mkdir(parents=True)
    folder.chmod(0o770)
    (remark,) = checkup.check_state_folder()
    assert remark.level is Level.WARN
    assert f"chmod go-w {folder}" in remark.remedy


def test_cell_files_are_checked(tmp_path):
    path = tmp_path / "robolink.toml"
    path.write_text(f'[cells.a]\nurl = "{IDENTITY}"\n')
    path.chmod(0o644)
    assert levels(checkup.check_cell_files()) == [("cells", Level.OK)] * 2
    path.chmod(0o646)
    assert levels(checkup.check_cell_files())[0] == ("cells", Level.WARN)
    path.write_text("[cells.a]\nurl = 3\nrobot = 3\n")
    remark = next(checkup.check_cell_files())
    assert remark.level is Level.BAD
    assert remark.what.endswith(": 2.")
    path.write_text("[")
    assert levels(checkup.check_cell_files())[0] == ("cells", Level.BAD)


class Fail:
    class Keyring:
        pass


@pytest.mark.parametrize(
    ("ring", "level"), [(Fail.Keyring(), Level.WARN), (Fail(), Level.OK)], ids=["none", "one"]
)
def test_the_keyring_is_looked_at(monkeypatch, ring, level):
    keyring, backends = ModuleType("keyring"), ModuleType("keyring.backends")
    monkeypatch.setattr(keyring, "get_keyring", lambda: ring, raising=False)
    monkeypatch.setattr(backends, "fail", Fail, raising=False)
    monkeypatch.setitem(sys.modules, "keyring", keyring)
    monkeypatch.setitem(sys.modules, "keyring.backends", backends)
    (found,) = checkup.check_keyring()
    assert found.level is level


def test_a_serial_port_that_may_not_be_used_names_its_group(monkeypatch):
    from robolink_cli.commands.computer.lines import SerialPort

    ports = [
        SerialPort("/dev/ttyUSB0", "adapter", "", "dialout", usable=False),
        SerialPort("COM3", "", "", "", usable=True),
    ]
    monkeypatch.setattr(checkup, "serial_ports", lambda: ports)
    closed, usable = checkup.check_serial_ports()
    assert (closed.level, usable.level) == (Level.WARN, Level.OK)
    assert "usermod -aG dialout" in closed.remedy


def test_unsettled_work_on_any_controller_is_listed(capsys):
    for number in (1, 2):
        log = open_journal().log(f"epson+tcp://192.0.2.{number}:5000")
        log.begin(Marker("a", MarkerKind.SET, "TLSet 3", "2026-01-01T00:00:00+00:00"))
        log.close()
    assert main.run(["doctor", "--json"]) == 0
    checks = json.loads(capsys.readouterr().out)["checks"]
    found = [check["remedy"] for check in checks if check["subject"] == "unsettled"]
    assert sorted(found) == [
        f'Run: robolink -c "epson+tcp://192.0.2.{number}:5000" recover' for number in (1, 2)
    ]


@pytest.mark.parametrize("content", ["nonsense", "SQLite format 3\0 and nothing else"])
def test_a_journal_that_makes_no_sense_is_bad(tmp_path, monkeypatch, content):
    journal = tmp_path / "broken.db"
    journal.write_text(content)
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(journal))
    (remark,) = checkup.check_journal()
    assert remark.level is Level.BAD
    assert str(journal) in remark.what


def fails(*_arguments, **_options):
    raise OSError(5, "Input/output error")


BROKEN = {
    "serial": "serial.tools.list_ports.comports",
    "name": "importlib.metadata.distributions",
    "python": "importlib.metadata.distribution",
    "click": "importlib.metadata.version",
    "state": "os.access",
    "cells": "platformdirs.user_config_path",
}
"""The subject of each check, and the system function that fails."""


@pytest.mark.parametrize("subject", BROKEN)
def test_a_look_that_breaks_off_is_one_line_and_the_others_go_on(capsys, monkeypatch, subject):
    monkeypatch.setattr(BROKEN[subject], fails)
    code = main.run(["doctor", "--json"])
    document = json.loads(capsys.readouterr().out)
    assert code in (0, 1)
    (broken,) = {
        (check["what"], check["level"])
        for check in document["checks"]
        if "Input/output error" in check["what"]
    }
    assert broken == (
        "this could not be checked (OSError: [Errno 5] Input/output error).",
        "warn",
    )
    assert {"journal", "keyring"} <= {check["subject"] for check in document["checks"]}


def test_what_is_wrong_stands_first(capsys, monkeypatch):
    install(monkeypatch, {"robolink": "0.1.0", "click": "9.5"}, ["click<9,>=8.1"])
    monkeypatch.setattr("importlib.metadata.distributions", fails)
    assert main.run(["doctor"]) == 1
    lines = [line.split()[0] for line in capsys.readouterr().out.splitlines()[:-1]]
    levels = [word for word in lines if word in ("bad", "warn", "ok")]
    assert levels[:2] == ["bad", "warn"]
    assert set(levels[2:]) == {"ok"}
