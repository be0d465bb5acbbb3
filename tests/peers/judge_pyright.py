"""pyright in its strict mode reads the programs of examples/services, as an editor does."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PYRIGHT = ROOT / ".venv/pyright/node_modules/pyright/index.js"


@pytest.fixture
def judge() -> list[str]:
    node = shutil.which("node")
    if node is None or not PYRIGHT.exists():
        pytest.skip("pyright is not here: make peers fetches it with npm")
    return [node, str(PYRIGHT), "--pythonpath", sys.executable]


def test_the_examples_have_no_fault_for_a_strict_checker(judge):
    ended = subprocess.run([*judge, "-p", str(ROOT)], capture_output=True, text=True, check=False)
    assert (ended.returncode, "0 errors" in ended.stdout) == (0, True), ended.stdout


def test_the_kind_that_was_named_is_the_type_that_is_got(judge, tmp_path):
    program = tmp_path / "kinds.py"
    program.write_text(
        "from typing import assert_type\n"
        "import robolink\n"
        "from robolink.controllers import EpsonController\n"
        'epson = robolink.connect("epson+sim://a", kind=EpsonController)\n'
        "assert_type(epson, EpsonController)\n"
        "either: robolink.Controller = epson\n"
        "print(either)\n"
        'anything = robolink.connect("epson+sim://b")\n'
        "assert_type(anything, robolink.Controller)\n"
        "anything.robot_number()\n",
        encoding="utf-8",
    )
    ended = subprocess.run([*judge, str(program)], capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    faults = [line for line in ended.stdout.splitlines() if " - error: " in line]
    assert all("kinds.py:10:" in line for line in faults), ended.stdout
    assert 'Cannot access attribute "robot_number"' in ended.stdout
