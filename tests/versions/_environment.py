"""A Python of a given version with given package versions, and the chosen tests in it."""

import os
import re
import shutil
import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from tests.versions._declared import ROOT

TOOLS: Final = (
    *("babel", "editables", "hatchling", "hypothesis", "pyte", "pytest", "pytest-timeout"),
    *("pytest-xdist", "scipy"),
)

CHOSEN: Final = (
    "tests/calibration/test_beams.py",
    "tests/calibration/test_board.py",
    "tests/calibration/test_camera.py",
    "tests/calibration/test_two_pose.py",
    "tests/calibration/test_vectors.py",
    "tests/contract/journal/test_journal_files.py",
    "tests/contract/journal/test_journal_databases.py",
    "tests/contract/test_epson_serial_line.py",
    "tests/contract/test_epson_tools.py",
    "tests/contract/test_plc_map.py",
    "tests/contract/test_recalibrate.py",
    "tests/contract/test_sim_softmotion_hosts.py",
    "tests/contract/test_softmotion_tools.py",
    "tests/cli/test_cli_frame.py",
    "tests/cli/test_cli_output.py",
    "tests/cli/test_commands_bad_input.py",
    "tests/cli/test_command_names.py",
    "tests/cli/test_doctor.py",
    "tests/cli/test_refusals_of_every_command.py",
    "tests/cli/test_report_command.py",
    "tests/cli/wizard",
    "tests/eye",
    "tests/fleet",
    "tests/panel/access/test_tls_product.py",
    "tests/panel/server",
    "tests/unit/structured_text/test_st_language.py",
    "tests/unit/test_config_files.py",
    "tests/unit/test_mailbox_link_can.py",
    "tests/unit/test_mailbox_link_modbus.py",
    "tests/unit/test_opcua_client.py",
    "tests/unit/test_opcua_security.py",
    "tests/unit/test_recipe_checks.py",
    "tests/unit/test_recipe_files.py",
    "tests/unit/test_report.py",
    "tests/unit/test_sim_kinematics.py",
    "tests/unit/test_sim_spel_expressions.py",
)
"""Tests of each dependency: files, prompts, tables, grammars, numbers, buses, pages, the
database.
"""


class NotRunError(Exception):
    """This machine lacks something that a run needs; the message names it."""


def python_of(version: str) -> Path:
    """Return a Python of a version, such as ``3.12``, that makes virtual environments.

    Looked for on the PATH, then where pyenv and uv keep theirs.

    Raises:
        NotRunError: There is none.
    """
    home = Path.home()
    kept = Path(os.environ.get("PYENV_ROOT", home / ".pyenv")) / "versions"
    uv = home / ".local/share/uv/python"
    on_path = shutil.which(f"python{version}")
    found = [Path(on_path)] if on_path else []
    found += sorted(kept.glob(f"{version}.*/bin/python3"))
    found += sorted(uv.glob(f"cpython-{version}.*/bin/python3"))
    program = "import sys, ensurepip, venv; print('%d.%d' % sys.version_info[:2])"
    for path in found:
        done = subprocess.run(
            [path, "-c", program], capture_output=True, text=True, timeout=60, check=False
        )
        if done.returncode == 0 and done.stdout.strip() == version:
            return path
    raise NotRunError(f"no Python {version} on the PATH, of pyenv or of uv")


class Environment:
    """A virtual environment that runs robolink from its sources.

    Args:
        folder: Its folder; existing files are removed.
        version: The version of Python, such as ``3.12``.

    Raises:
        NotRunError: There is no such Python here.
    """

    def __init__(self, folder: Path, version: str) -> None:
        base = python_of(version)
        shutil.rmtree(folder, ignore_errors=True)
        self.folder = folder
        self.python = str(folder / "bin" / "python")
        self.run([str(base), "-m", "venv", str(folder)])

    def run(
        self, command: Sequence[str], *, ahead: Path | None = None
    ) -> subprocess.CompletedProcess[str]:
        """Run a command; the result has its output.

        Args:
            command: The words.
            ahead: A folder whose packages come before those of the environment.

        Raises:
            NotRunError: It is a pip command, and pip cannot get a package here.
        """
        variables = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("ROBOLINK", "PYTEST", "PYTHON"))
        }
        variables |= {"ROBOLINK_STATE_DIR": str(self.folder / "state")}
        variables |= {"PYTHONDONTWRITEBYTECODE": "1"}
        variables |= {"PYTHONPATH": str(ahead)} if ahead else {}
        done = subprocess.run(
            command,
            cwd=ROOT,
            env=variables,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=1500,
            check=False,
        )
        if done.returncode and "pip" in command:
            lines = done.stderr.strip().splitlines() or [f"pip ended with {done.returncode}"]
            raise NotRunError(f"pip: {lines[-1]}")
        return done

    def install(self, packages: Iterable[str], *, into: Path | None = None) -> None:
        """Install packages; robolink itself is installed from its sources.

        Args:
            packages: Requirements for pip.
            into: A folder beside the environment.
        """
        target = ["--target", str(into)] if into else []
        pip = [self.python, "-m", "pip", "install", "--quiet", "--no-compile"]
        self.run([*pip, *target, *packages])

    def install_sources(self) -> None:
        """Install robolink from its sources without its dependencies."""
        pip = [self.python, "-m", "pip", "install", "--quiet", "--no-deps"]
        self.run([*pip, "--no-build-isolation", "--editable", str(ROOT)])

    def versions(self, names: Sequence[str]) -> dict[str, str]:
        """Return the installed versions, by name; ``python`` is the first."""
        program = (
            "import importlib.metadata as m, platform, sys;"
            "print(platform.python_version(), *map(m.version, sys.argv[1:]))"
        )
        shown = self.run([self.python, "-c", program, *names]).stdout.split()
        return dict(zip(("python", *names), shown, strict=True))

    def test(self, tests: Sequence[str], *, ahead: Path | None = None) -> str:
        """Run tests; return pytest's last line.

        Raises:
            AssertionError: Not all passed; with pytest's output.
        """
        done = self._pytest(tests, ahead)
        assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]
        assert re.search(r"\d+ passed", done.stdout), done.stdout[-5000:]
        return done.stdout.splitlines()[-1]

    def failure(self, test: str, *, ahead: Path) -> str:
        """Run a test file; return why its first test fails, empty if all pass.

        Raises:
            AssertionError: It ended in another way than with a failing test.
        """
        done = self._pytest(["--maxfail=1", test], ahead)
        if done.returncode == 0:
            return ""
        shown = done.stdout + done.stderr  # there an import tells that fails in a conftest
        lines = [line for line in shown.splitlines() if line.startswith("E  ")]
        assert lines, f"no test failed, but: {shown[-5000:]}"
        told = next((one for one in lines if "Error" in one), lines[0])
        return " ".join(re.sub(r"\(?/\S*", "", told).removeprefix("E").split())

    def _pytest(self, words: Sequence[str], ahead: Path | None) -> subprocess.CompletedProcess[str]:
        pytest = [self.python, "-m", "pytest", "-q", "--tb=short", "-p", "no:cacheprovider"]
        return self.run([*pytest, "-p", "no:xdist", *words], ahead=ahead)

    def demonstrate(self) -> None:
        """Run the demonstration.

        Raises:
            AssertionError: It did not end well; with its output.
        """
        done = self.run([self.python, "-m", "robolink_cli", "demo", "--speed", "20"])
        assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]
