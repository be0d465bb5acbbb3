"""panel --demo: three kinds of simulated cells, in a folder of their own; all end together."""

import asyncio
import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from robolink_cli.commands.computer.panel import require_packages
from robolink_cli.commands.simulate.panel_cells import _pin
from robolink_cli.panel.guard.people import require_pin

from robolink.errors import ConfigError
from robolink.model import Secret
from tests import _warm_process
from tests.panel.server._panel import Tablet

# Each waits for processes to start, which a busy computer does slowly.
pytestmark = pytest.mark.timeout(240)


def children(pid):
    """Return the processes that a process has started, without what the tests fork for it."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, text = path.read_text().rpartition(")")
        except OSError:
            continue
        if int(text.split()[1]) == pid and not name.endswith(f"({_warm_process.NAME}"):
            found.append(int(path.parent.name))
    return found


def are_gone(pids, within_s=30.0):
    until_s = time.monotonic() + within_s
    while time.monotonic() < until_s:
        if not [pid for pid in pids if Path(f"/proc/{pid}").exists()]:
            return True
        time.sleep(0.05)
    return False


def test_three_kinds_of_cells_can_be_looked_at_and_end_with_the_panel():
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "robolink_cli", "--json", "panel", "--demo"),
            *("--listen", "127.0.0.1:0"),
        ],
        stdout=subprocess.PIPE,
    )
    folder = Path("/nowhere")
    try:
        assert process.stdout is not None
        with process.stdout:
            told = json.loads(process.stdout.readline())
        assert told["pid"] == process.pid
        assert told["cells"] == ["scara", "tilting", "dispenser"]
        beside = children(process.pid)
        assert len(beside) == 2, "the simulators, and the process that stops"
        if sys.platform == "linux":  # else each takes seconds to import what it needs
            lines = [Path(f"/proc/{pid}/cmdline").read_bytes() for pid in beside]
            assert all(b"tests._warm_process" in line for line in lines)
        folder = Path(told["demo"]["state_dir"]).parent
        assert folder.is_dir()
        asyncio.run(look(int(told["url"].rstrip("/").rpartition(":")[2]), told))
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 0
        assert are_gone(beside)
        assert not folder.exists()
    finally:
        process.kill()
        process.wait()
        shutil.rmtree(folder, ignore_errors=True)


async def look(port, told):
    tablet = Tablet(port)
    assert tablet.login(told["demo"]["pin"]) == 200
    for cell in told["cells"]:
        async with tablet.live(cell) as page:
            await page.until(lambda page: "ready" in page.parts.get("head", ""))
    async with tablet.live() as page:
        await page.until(lambda page: page.parts.get("main", "").count("ready") == 3)


def test_its_pin_is_one_that_is_taken():
    for _ in range(200):
        require_pin(Secret(_pin()))


def test_a_missing_package_is_named_with_what_to_install():
    with pytest.raises(ConfigError) as refused:
        require_packages(("json", "no_such_package_of_pages"))
    assert "no_such_package_of_pages" in refused.value.what
    assert "json" not in refused.value.what
    assert "pip install 'robolink[panel]'" in refused.value.remedy
