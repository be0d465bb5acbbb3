"""The time of a stop, alone and with 50 watchers at the same time."""

import statistics
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.stopping import StopListener, holders_of
from robolink.transport import far_end_of

pytestmark = [pytest.mark.simulator_only, pytest.mark.soak, pytest.mark.timeout(300)]

LOOKERS = 50
STOPS = 40
MORE_S = 0.5
"""A stop that waited for one watcher would wait for its line: a second."""

LOOKING = """
import sys, threading, time
from robolink.stopping import holders_of
from robolink.transport import far_end_of
(holder,) = holders_of(far_end_of(sys.argv[1]))
def look():
    while True:
        try:
            holder.last_seen()
        except Exception:
            pass
        time.sleep(float(sys.argv[3]))
for _ in range(int(sys.argv[2])):
    threading.Thread(target=look, daemon=True).start()
print("looking", flush=True)
sys.stdin.read()
"""


@contextmanager
def looking(url, pause_s):
    """Start fifty threads of another process that watch, each with a pause between its readings."""
    command = [sys.executable, "-c", LOOKING, url, str(LOOKERS), str(pause_s)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as others:
        assert others.stdout is not None
        assert others.stdout.readline() == b"looking\n"
        try:
            yield
        finally:
            others.kill()


def times_of(holder, controller):
    found = []
    for _ in range(STOPS):
        begun = time.perf_counter()
        assert holder.ask_to_stop("the test") == "ready"
        found.append(time.perf_counter() - begun)
        controller.release_stop()
    return found


@pytest.mark.parametrize("pause_s", [0.0, 0.1, 1.0])
def test_a_stop_takes_as_long_with_fifty_who_look_on(
    tmp_path, monkeypatch, record_property, pause_s
):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "s"))
    with serve_tcp(EpsonSimulator(seed=3)) as host, robolink.connect(host.url) as controller:
        url, status = host.url, controller.status()
        with StopListener(controller, url, seen=lambda: (status, 0)):
            (holder,) = holders_of(far_end_of(url))
            alone = times_of(holder, controller)
            with looking(url, pause_s):
                beside = times_of(holder, controller)
    told = {
        name: {"median_ms": statistics.median(of) * 1e3, "worst_ms": max(of) * 1e3}
        for name, of in (("alone", alone), ("beside", beside))
    }
    record_property("stop_ms", told)
    assert statistics.median(beside) < statistics.median(alone) + MORE_S
