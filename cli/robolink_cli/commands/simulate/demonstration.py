"""The demonstration: serve a simulator, connect to it, change a nozzle, compare with truth."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from robolink_simulators.assist.port import InProcessEyes
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.softmotion import simulator_named
from robolink_simulators.hosting.streams.epson_tcp import serve_tcp

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
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.prompts.operator import AssistedOperator
from robolink_cli.views.calibration import report_payload, show_proposal, show_report
from robolink_cli.views.documents import offset_payload

TOOL = 1

_KINEMATICS = "Kin_Scara3_Z"

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


@dataclass(frozen=True, slots=True)
class Demonstrated:
    """A nozzle change on one simulated controller, next to the truth.

    Attributes:
        kind: Kind of controller.
        robot: What moves.
        report: What was measured, written and verified.
        truth: Where the tip really is.
        exchanges: Requests that it took.
    """

    kind: str
    robot: str
    report: ToolReport
    truth: ToolOffset
    exchanges: int

    @property
    def error_mm(self) -> float:
        """How far from the truth the tip was found, in the plane."""
        found, true = self.report.proposal.offset, self.truth
        return math.dist(found.components()[:2], true.components()[:2])

    @property
    def drift_mm(self) -> float:
        """The largest drift about the new tip."""
        if self.report.verification is None:
            raise VerifyError(tr("The demonstration was not verified."))
        return self.report.verification.max_drift_mm

    def payload(self) -> dict[str, object]:
        """Return it as plain JSON."""
        return {
            "kind": self.kind,
            "robot": self.robot,
            "recovered": offset_payload(self.report.proposal.offset),
            "truth": offset_payload(self.truth),
            "error_mm": self.error_mm,
            "drift_mm": self.drift_mm,
            "exchanges": self.exchanges,
            **report_payload(self.report),
        }

    def show(self) -> None:
        """Say how it ended, and how far off it was."""
        say()
        show_report(self.report)
        say(
            tr(
                "The true tip is at X {x:.3f} Y {y:.3f}: found with an error of {error:.3f} mm, "
                "by {exchanges} exchanges. Checked against the simulator, not a robot.",
                x=self.truth.x_mm,
                y=self.truth.y_mm,
                error=self.error_mm,
                exchanges=self.exchanges,
            )
        )


def demonstrate(*, seed: int, speed: float) -> None:
    """Run the demonstration and show it, or hand over its document."""
    epson = _on_epson(seed, speed)
    say()
    plc = _on_plc(seed)
    if json_is_on():
        both = [epson.payload(), plc.payload()]
        emit_json("robolink/demo/2", {"simulated": True, "controllers": both})


def _on_epson(seed: int, speed: float) -> Demonstrated:
    """Change a nozzle on a simulated EPSON SCARA, over a real TCP connection."""
    simulator = EpsonSimulator("T6-602S", seed=seed)
    wire = WireLog()
    with serve_tcp(simulator, clock=ScaledClock(speed)) as host:
        _announce(tr("SIMULATED EPSON T6-602S, served at {url}", url=host.url))
        outcomes = memory_journal(host.url).log(host.url)
        with robolink.connect(host.url, outcomes=outcomes, trace=wire) as controller:
            report = _change(controller, InProcessEyes(simulator))
            exchanges = controller.exchanges
    done = Demonstrated("epson", "T6-602S", report, simulator.world.tips[TOOL], exchanges)
    done.show()
    say()
    say(tr("sent on the wire (left out: reads, and low power and speed before each move):"))
    for line in wire.of_writes():
        say(f"  {line}")
    return done


def _on_plc(seed: int) -> Demonstrated:
    """Change a nozzle on a simulated SoftMotion PLC, in this process and in simulated time."""
    url = f"softmotion+sim://demo-{seed}?kinematics={_KINEMATICS}&seed={seed}"
    _announce(tr("SIMULATED CODESYS SoftMotion PLC, {url}", url=url))
    with robolink.connect(url) as controller:
        simulator = simulator_named(f"demo-{seed}")
        report = _change(controller, InProcessEyes(simulator))
        exchanges = controller.exchanges
    done = Demonstrated("softmotion", _KINEMATICS, report, simulator.world.tips[TOOL], exchanges)
    done.show()
    return done


def _announce(simulated: str) -> None:
    say(simulated)
    say(tr("The nozzle was changed; tool {tool} still holds the old tip.", tool=TOOL))
    say()


def _change(controller: Controller, eyes: InProcessEyes) -> ToolReport:
    controller.motors(True)
    change = NozzleChange(
        controller,
        ChangePlan((ToolPlan(TOOL),), ask_before_write=False),
        operator=AssistedOperator.with_eyes(eyes, lambda text: say(f"  {text}"), tool=lambda: TOOL),
        listener=_Shown(),
    )
    (report,) = change.run().tools
    return report


class _Shown(Listener):
    def proposed(self, proposals: Sequence[Proposal]) -> None:
        for proposal in proposals:
            show_proposal(proposal)
