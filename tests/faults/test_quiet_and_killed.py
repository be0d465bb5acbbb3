"""A program with an open change, in real time: idle beyond the silence limit, then killed."""

import subprocess
import sys
import threading

import pytest
from robolink_cli import main
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

OPEN_AND_QUIET = """
import sys
import robolink
from robolink import ANY, ToolOffset
from robolink.transaction import ToolChange, Wanted
with robolink.connect(sys.argv[1]) as plc:
    with ToolChange(plc, [Wanted(1, ToolOffset(12.3, -3.7, -20.5), ANY)], verify=True) as change:
        change.write()
        print("open", flush=True)
        input()
"""
QUIET_S = 12.0


@pytest.mark.soak
@pytest.mark.fault("F46")
def test_who_is_quiet_keeps_all_and_who_was_killed_is_named_and_waited_out(
    tmp_path, monkeypatch, capfd
):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    simulator = SoftMotionSimulator(seed=7)
    before = simulator.plc.memory.slot(1).tool[2]
    with serve_modbus_tcp(simulator) as host:
        child = subprocess.Popen(
            [sys.executable, "-c", OPEN_AND_QUIET, host.url],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert child.stdout is not None
            assert child.stdout.readline() == "open\n"
            threading.Event().wait(QUIET_S)
            assert main.run(["-c", host.url, "recover", "--yes"]) == 5
            refused = capfd.readouterr().err
            assert f"process {child.pid} on" in refused
            assert simulator.plc.memory.slot(1).tool[2] == -20.5
            child.kill()
            child.wait()
            assert main.run(["-c", host.url, "recover", "--yes"]) == 0
            told = capfd.readouterr().err
            assert f"process {child.pid} on" in told
            assert "ended without releasing it. Waiting until it is free" in told
        finally:
            child.kill()
            child.communicate()
    assert simulator.plc.memory.slot(1).tool[2] == before
