"""A client in JavaScript calibrates a tool over the control API, and presses the emergency stop."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests._patience import PATIENCE_S

CLIENT = Path(__file__).parent / "control_client.mjs"


def test_a_client_in_another_language_calibrates_and_stops():
    paths = os.pathsep.join(path for path in sys.path if path)
    done = subprocess.run(
        ["node", str(CLIENT), sys.executable],
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["login"] == "#Login,0"
    assert told["written"] == "#Execute,0"
    for name in ("x_mm", "y_mm"):
        assert told["stored"][name] == pytest.approx(told["tip"][name], abs=0.002)
    assert abs(told["stored"]["x_mm"] - 12.0) > 0.1  # it was not so before
    flags = told["stopped"].split(",")[1]
    assert flags[2] == "1", f"no emergency stop in {told['stopped']}"
    assert told["refused"] == 404
    assert told["requests"] == 3
    assert ends(told["simulator"])


def ends(process: int) -> bool:
    """Return whether a process ends by itself without a stop."""
    for _ in range(100):
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False
