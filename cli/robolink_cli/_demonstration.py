"""The demonstration: serve a simulator, connect to it, change a nozzle, compare with truth."""

import math
from collections.abc import Sequence

from robolink_simulators.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.tcp import serve_tcp

import robolink
from robolink.errors import VerifyError
from robolink.journal import memory_journal
from robolink.messages import tr
from robolink.model import Controller, ToolOffset
from robolink.nozzle_change import (
    ChangePlan,
    Listener,
    NozzleChange,
    Proposal,
    ToolPlan,
    ToolReport,
)
from robolink_cli._calibration_views import report_payload, show_proposal, show_report
from robolink_cli._operator import AssistedOperator
from robolink_cli._render import emit_json, json_is_on, say
from robolink_cli._views import offset_payload

TOOL = 1

_OF_INTEREST = tuple(f'> $Execute,"{word} ' for word in ("Tool", "TLSet", "Move", "Go"))


class WireLog:
    """Collects what crossed the wire, the login excepted."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def __call__(self, _time_ns: int, direction: str, data: bytes) -> None:
        """Note one piece of traffic."""
        mark = ">" if direction == "sent" else "<"
        self.lines.extend(f"{mark} {line}" for line in data.decode("ascii").splitlines() if line)

    def of_writes(self) -> list[str]:
        """Return the requests that selected, moved or wrote something, with their answers.

        Left out are reads, and the power mode and speeds that go before each move.
        """
        shown = []
        waiting = ""
        for line in self.lines:
            if line.startswith(_OF_INTEREST):
                waiting = line
            elif waiting and line.startswith(("< #Execute", "< !Execute")):
                shown.append(f"{waiting:<66}{line}")
                waiting = ""
        return shown


def demonstrate(*, seed: int, speed: float) -> None:
    """Run the demonstration and show it, or hand over its document."""
    simulator = EpsonSimulator("T6-602S", seed=seed)
    wire = WireLog()
    with serve_tcp(simulator, clock=ScaledClock(speed)) as host:
        say(tr("SIMULATED EPSON T6-602S, served at {url}", url=host.url))
        say(tr("The nozzle was changed; tool {tool} still holds the old tip.", tool=TOOL))
        say()
        journal = memory_journal(host.url)
        outcomes = journal.log(host.url)
        with robolink.connect(host.url, outcomes=outcomes, trace=wire) as controller:
            controller.motors(True)
            report = _change(controller, simulator)
            exchanges = controller.exchanges
    truth = simulator.world.tips[TOOL]
    error_mm = math.dist(report.proposal.offset.components()[:2], truth.components()[:2])
    if json_is_on():
        emit_json("robolink/demo/1", _document(report, truth, error_mm, exchanges))
        return
    say()
    show_report(report)
    say()
    say(tr("sent on the wire (left out: reads, and low power and speed before each move):"))
    for line in wire.of_writes():
        say(f"  {line}")
    say()
    say(
        tr(
            "The true tip is at X {x:.3f} Y {y:.3f}: found with an error of {error:.3f} mm, by "
            "{exchanges} exchanges. Checked against the simulator, not a robot.",
            x=truth.x_mm,
            y=truth.y_mm,
            error=error_mm,
            exchanges=exchanges,
        )
    )


def _change(controller: Controller, simulator: EpsonSimulator) -> ToolReport:
    def look() -> tuple[float, float, float]:
        seen = simulator.world.operator.look(TOOL)
        return seen.dx_mm, seen.dy_mm, seen.dz_mm

    change = NozzleChange(
        controller,
        ChangePlan((ToolPlan(TOOL),), ask_before_write=False),
        operator=AssistedOperator(look, lambda text: say(f"  {text}")),
        listener=_Shown(),
    )
    (report,) = change.run().tools
    return report


class _Shown(Listener):
    def proposed(self, proposals: Sequence[Proposal]) -> None:
        for proposal in proposals:
            show_proposal(proposal)


def _document(
    report: ToolReport, truth: ToolOffset, error_mm: float, exchanges: int
) -> dict[str, object]:
    verification = report.verification
    if verification is None:
        raise VerifyError(tr("The demonstration was not verified."))
    return {
        "simulated": True,
        "recovered": offset_payload(report.proposal.offset),
        "truth": offset_payload(truth),
        "error_mm": error_mm,
        "drift_mm": verification.max_drift_mm,
        "exchanges": exchanges,
        "controllers": [{"kind": "epson", "robot": "T6-602S", **report_payload(report)}],
    }
