"""expert serve --plc: the program of a PLC calls, and the machine goes on with a proved tool."""

import json
import os
import signal

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.hosting.in_process.softmotion import register, unregister
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.mailbox.options import MailboxOptions

from tests.contract._permit_machine import PermitMachine

SERVED = ("serve", "--plc", "n-angle", "--tool", "1", "--sigma-mm", "0.01", "--json")


class MachineClock(ManualClock):
    """Time in which the machine goes on whenever somebody waits; it produces before each call."""

    parts = 12

    def __init__(self, simulator):
        super().__init__()
        self.machine = PermitMachine(simulator)
        self.calls: list[str] = []
        self.produced = 0

    def sleep(self, seconds):
        super().sleep(seconds)
        self.produced += 1
        if self.produced < self.parts:
            return
        self.machine.look()
        if self.machine.state in ("produces", "gave up"):
            self.calls.append(self.machine.state)
            self.machine.bump_mm = 0.0
            self.machine.begin()
            self.produced = 0
            if len(self.calls) == 2:
                os.kill(os.getpid(), signal.SIGTERM)


def test_calls_are_answered_one_after_the_other_until_somebody_ends_it(capsys):
    options = PlcOptions(mailbox=MailboxOptions(profile="tools"))
    simulator = SoftMotionSimulator(seed=7, options=options)
    clock = MachineClock(simulator)
    url = register("serve-plc", simulator, clock=clock)
    clock.machine.bump_mm = 0.15
    try:
        assert main.run(["-c", url, *SERVED, "--permit-is-contact"]) == 0
    finally:
        unregister("serve-plc")
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one["event"] for one in told] == ["listening", "refused", "kept"]
    assert clock.calls == ["produces"] * 2
    assert told[1]["code"] == "point_moved"
    assert told[2]["tool"] == 1
    assert clock.machine.error_mm < 0.02
    assert not clock.machine.panel.tool_changed


@pytest.mark.parametrize(
    "words",
    [
        ("serve",),
        ("serve", "--plc", "n-angle", "--spel", "127.0.0.1:0"),
        SERVED,
        ("serve", "--plc", "n-angle", "--permit-is-contact"),
        (*SERVED, "--permit-is-contact", "--touches", "3"),
    ],
    ids=["neither", "both", "no-witness", "no-tool", "few-touches"],
)
def test_what_would_prove_nothing_is_refused_before_the_plc_is_asked(words):
    assert main.run(["-c", "softmotion+modbus-tcp://127.0.0.1:1", *words]) == 2


def test_a_controller_without_a_mailbox_is_refused():
    words = [*SERVED, "--permit-is-contact"]
    assert main.run(["-c", "epson+sim://no-mailbox", *words]) == 2
