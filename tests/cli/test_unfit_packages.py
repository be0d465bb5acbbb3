"""A package of another version than is asked for is named, whatever it makes fail.

What is put before the packages of this machine is a package as pip leaves it: its files, and
metadata with a version.
"""

import json
import os
import subprocess
import sys
from importlib import metadata

import pytest

from tests._documents import wrong_in

BREAKS = "raise ImportError('no such thing in this version')"


CELL = '[cells.a]\nurl = "epson+tcp://192.0.2.1:5000"\n'


@pytest.fixture
def instead(tmp_path):
    """Run a command with another version of a package in front."""

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


@pytest.mark.parametrize("name", ["click", "pydantic", "rich"])
def test_doctor_names_what_is_there_and_what_is_needed(instead, name):
    done = instead(name, "1.0.3", BREAKS, "doctor")
    assert done.returncode == 1, done.stderr
    first = done.stdout.splitlines()[0]
    assert first.startswith(f"bad   {name}: 1.0.3 is installed, ")
    assert first.endswith(" is needed.")
    assert "\nok    python: " in done.stdout
    assert done.stdout.endswith("Something is wrong; see the first lines.\n")


def test_doctor_without_click_speaks_json_too(instead):
    done = instead("click", "1.0.3", BREAKS, "doctor", "--json")
    assert done.returncode == 1, done.stderr
    document = json.loads(done.stdout)
    assert (document["schema"], document["healthy"]) == ("robolink/doctor/1", False)
    assert wrong_in(document) == []
    first = document["checks"][0]
    assert (first["subject"], first["level"]) == ("click", "bad")


@pytest.mark.parametrize("name", ["click", "pydantic"])
def test_a_command_that_such_a_package_breaks_is_no_defect(instead, name):
    done = instead(name, "1.0.3", BREAKS, "cell", "list", "--json")
    assert done.returncode == 2, done.stdout
    document = json.loads(done.stdout)
    assert wrong_in(document) == []
    assert document["exit_code"] == 2
    assert f"{name}: 1.0.3 is installed" in document["error"]["what"]
    assert "no such thing in this version" in document["error"]["what"]
    assert f"python -m pip install '{name}" in document["error"]["remedy"]


def test_where_every_package_fits_a_failure_stays_a_defect(instead):
    done = instead("pydantic", metadata.version("pydantic"), BREAKS, "cell", "list")
    assert done.returncode == 70, done.stdout
    assert "A defect in robolink: ImportError: no such thing in this version" in done.stderr
    done = instead("click", metadata.version("click"), BREAKS, "cell", "list")
    assert "ImportError: no such thing in this version" in done.stderr
