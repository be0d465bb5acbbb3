"""Without a terminal nothing waits for a person who is not there, whatever is typed."""

import resource
import subprocess
import sys
import time

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

pytestmark = pytest.mark.simulator_only

LONGEST_CPU_S = 4.0
"""Imports and the first exchanges; 1.8 s at most on the machine on which it was written."""


def spent_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


@pytest.mark.soak
@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ((), 2, "Usage: robolink"),
        (("change",), 9, "There is nobody to ask here."),
        (("calibrate", "two-pose", "--tool", "1"), 9, "nobody"),
        (("recover",), 0, "Nothing is left unfinished"),
    ],
)
def test_every_entry_ends_by_itself(words, code, said):
    simulator = EpsonSimulator(seed=7)
    with serve_tcp(simulator) as host:
        named = ("-c", host.url) if words else ()
        began_s, before_s = time.monotonic(), spent_s()
        ended = subprocess.run(
            [sys.executable, "-m", "robolink_cli", *named, *words],
            check=False,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert spent_s() - before_s < LONGEST_CPU_S, f"{time.monotonic() - began_s:.1f} s of wall"
    assert ended.returncode == code, ended.stderr
    assert said in ended.stderr + ended.stdout
    assert simulator.machine.arm.moves_started == 0
