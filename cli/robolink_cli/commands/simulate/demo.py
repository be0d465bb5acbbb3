"""demo: a whole nozzle change on each kind of simulated controller."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Literal

import click
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.control.assist import LEAST_THINKING_S, InProcessEyes
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process import epson, softmotion
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

import robolink
from robolink.calibration_run import (
    ChangePlan,
    Listener,
    NozzleChange,
    Proposal,
    ToolPlan,
    ToolReport,
)
from robolink.errors import CalibrationError, VerifyError
from robolink.journal import memory_journal
from robolink.messages import tr
from robolink.model import Controller
from robolink.timing import NS_PER_S
from robolink.transport import parse_url
from robolink_cli.commands.simulate.demo_changes import (
    TOOL,
    AcceptedChange,
    DemonstratedChange,
    RefusedChange,
)
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import AnswerTime
from robolink_cli.prompts.operator import AssistedOperator
from robolink_cli.views.fit import show_proposal


@click.command()
@json_option
def demo(
    *,
    seed: Annotated[
        int, CliOption(help="Seed of the simulated cell; another seed has another tip.")
    ] = 1,
    speed: Annotated[
        float,
        NumberInside(0, 100),
        CliOption(
            metavar="FACTOR",
            help="How many times faster than real time the SCARA runs, 1 to 100. At 0, time "
            "passes only while robolink waits, and the duration is shown.",
        ),
    ] = 20.0,
    answer_ms: AnswerTime = 0.0,
    operator: Annotated[
        Literal["careful", "careless"],
        CliOption(
            help="Who touches the pin; a careless person only presses Enter, and robolink "
            "must refuse that."
        ),
    ] = "careful",
    eye: Annotated[
        bool,
        CliOption(
            help="Measure with robolink's own eye: tips are found in drawn pictures of an "
            "up-looking camera, which come over HTTP. Nobody touches anything."
        ),
    ] = False,
) -> None:
    """Change the nozzle of a simulated EPSON SCARA, then of a simulated SoftMotion PLC.

    The SCARA is reached over a TCP connection on this machine's loopback (with --speed 0 inside
    this process), the PLC through its mailbox inside this process. No machine is touched.
    """
    if 0 < speed < 1:
        raise click.UsageError(tr("--speed is 0, or from 1 to 100."))
    person = DemoOperator(operator)
    if eye and person is DemoOperator.CARELESS:
        raise click.UsageError(tr("With --eye nobody touches anything: leave --operator out."))
    demonstrate(DemoSettings(seed=seed, speed=speed, operator=person, answer_ms=answer_ms, eye=eye))


_ROBOT = "T6-602S"
_KINEMATICS = "Kin_Scara3_Z"

_OF_INTEREST = tuple(f'> $Execute,"{word} ' for word in ("Tool", "TLSet", "Move", "Go"))


class DemoOperator(StrEnum):
    """The person at the demonstrated cells."""

    CAREFUL = "careful"
    """Jogs the tip onto the pin whenever asked."""

    CARELESS = "careless"
    """Only presses ENTER."""


class WireLog:
    """Collects the traffic on the wire, except for the login."""

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
class DemoSettings:
    """What was typed.

    Attributes:
        seed: Of the simulated cells.
        speed: How many times faster than real time the SCARA runs; 0 for simulated time alone.
        operator: Who touches the pin.
        answer_ms: How long after a request its answer leaves, in simulated milliseconds.
        eye: Whether tips are found in drawn pictures.
    """

    seed: int
    speed: float
    operator: DemoOperator
    answer_ms: float
    eye: bool = False

    @property
    def stays_share(self) -> float:
        """Share of the touches at which the person leaves the tip where it is."""
        return 1.0 if self.operator is DemoOperator.CARELESS else 0.0

    def url(self, scheme: str, machine: str) -> str:
        """Return the URL of a simulator in this process."""
        url = f"{scheme}://demo-{self.seed}-{self.operator}?{machine}&seed={self.seed}"
        if self.answer_ms:
            url += f"&answer_ms={self.answer_ms:g}"
        if self.stays_share:
            url += f"&world.person_stays_share={self.stays_share:g}"
        return url


def demonstrate(given: DemoSettings) -> None:
    """Run the demonstration and show it, or return its document.

    Raises:
        CalibrationError, VerifyError: A careful person was refused.
        RuntimeError: A careless one was believed, which is a defect, or a refusal left another tool
            in force.
    """
    scara = _on_epson(given)
    say()
    both = (scara, _on_plc(given))
    if given.operator is DemoOperator.CARELESS:
        require_refused(both)
    if json_is_on():
        document = {
            "simulated": True,
            "operator": given.operator.value,
            "answer_ms": given.answer_ms,
            "eye": given.eye,
            "controllers": [one.payload() for one in both],
        }
        emit_json("robolink/demo/2", document)


def require_refused(changes: Sequence[DemonstratedChange]) -> None:
    """Raise unless every one of some changes by a careless person was refused.

    Raises:
        RuntimeError: Names where the person was believed.
    """
    believed = [one.robot for one in changes if isinstance(one, AcceptedChange)]
    if believed:
        raise RuntimeError(
            tr("robolink accepted the careless touches, on {robots}.", robots=", ".join(believed))
        )


def _on_epson(given: DemoSettings) -> DemonstratedChange:
    """Change a nozzle on a simulated EPSON SCARA, over TCP or in simulated time."""
    wire = WireLog()
    done = _by_itself(given, wire) if given.speed == 0 else _over_tcp(given, wire)
    done.show()
    done.show_duration()
    say()
    say(tr("sent on the wire (left out: reads, and low power and speed):"))
    for line in wire.of_writes():
        say(f"  {line}")
    return done


def _over_tcp(given: DemoSettings, wire: WireLog) -> DemonstratedChange:
    """Change the nozzle over a real TCP connection."""
    # The driver uses real time, and so does the simulated person.
    share, thinks_s = given.stays_share, LEAST_THINKING_S
    simulator = EpsonSimulator(
        _ROBOT,
        seed=given.seed,
        world=WorldParameters(person_stays_share=share, person_thinks_s=thinks_s),
        answer_ms=given.answer_ms,
    )
    with serve_tcp(simulator, clock=ScaledClock(given.speed)) as host:
        _announce(tr("SIMULATED EPSON T6-602S, served at {url}", url=host.url), given.operator)
        outcomes = memory_journal(host.url).log(host.url)
        with robolink.connect(host.url, outcomes=outcomes, trace=wire) as controller:
            return _Cell("epson", _ROBOT, simulator, given).change(controller)


def _by_itself(given: DemoSettings, wire: WireLog) -> DemonstratedChange:
    """Change the nozzle in this process and in simulated time."""
    url = given.url("epson+sim", f"robot={_ROBOT}")
    _announce(tr("SIMULATED EPSON T6-602S, {url}", url=url), given.operator)
    name = parse_url(url).host
    try:
        with robolink.connect(url, trace=wire) as controller:
            cell = _Cell("epson", _ROBOT, epson.simulator_named(name), given)
            return cell.change(controller)
    finally:
        epson.unregister(name)


def _on_plc(given: DemoSettings) -> DemonstratedChange:
    """Change a nozzle on a simulated SoftMotion PLC, in this process and in simulated time."""
    url = given.url("softmotion+sim", f"kinematics={_KINEMATICS}")
    _announce(tr("SIMULATED CODESYS SoftMotion PLC, {url}", url=url), given.operator)
    name = parse_url(url).host
    try:
        with robolink.connect(url) as controller:
            simulator = softmotion.simulator_named(name)
            cell = _Cell("softmotion", _KINEMATICS, simulator, given)
            done = cell.change(controller)
    finally:
        softmotion.unregister(name)
    done.show()
    done.show_duration()
    return done


def _announce(simulated: str, operator: DemoOperator) -> None:
    say(simulated)
    say(tr("The nozzle was changed; tool {tool} still holds the old tip.", tool=TOOL))
    if operator is DemoOperator.CARELESS:
        say(tr("The person at this cell only presses Enter: the tip never comes onto the pin."))
    say()


@dataclass(frozen=True, slots=True)
class _Cell:
    """A simulated cell, with the person at it."""

    kind: str
    robot: str
    simulator: EpsonSimulator | SoftMotionSimulator
    given: DemoSettings

    def change(self, controller: Controller) -> DemonstratedChange:
        """Change the nozzle, and return how it ended; a careless person may be refused."""
        before = controller.tools.read(TOOL)
        truth = self.simulator.world.tips[TOOL]
        try:
            report, pictures = self._report(controller)
        except (CalibrationError, VerifyError) as error:
            if self.given.operator is not DemoOperator.CARELESS:
                raise
            held = controller.tools.read(TOOL)
            if held is None or not controller.tools.same(held, before):
                raise RuntimeError(tr("The refusal left another tool selected.")) from error
            return RefusedChange(
                self.kind, self.robot, truth, *self._spent(controller), error, in_force=held
            )
        return AcceptedChange(
            self.kind, self.robot, truth, *self._spent(controller), report, before, pictures
        )

    def _spent(self, controller: Controller) -> tuple[int, int | None, float | None]:
        """Return the exchanges since the cell was connected to, their bytes, and seconds."""
        clock = controller.clock  # that of a simulator in this process began at 0
        simulated = isinstance(clock, ManualClock)
        simulated_s = clock.now_ns() / NS_PER_S if simulated else None
        return controller.exchanges, controller.traffic_bytes, simulated_s

    def _report(self, controller: Controller) -> tuple[ToolReport, int | None]:
        """Change the nozzle; returns with the report how many pictures were taken."""
        controller.motors(True)
        if not self.given.eye:
            return self._changed(controller, ToolPlan(TOOL)), None
        from robolink_cli.commands.simulate.demo_eye import DemoEye

        eye = DemoEye(self.simulator)
        with eye.source() as source:
            report = self._changed(controller, ToolPlan(TOOL, source))
        return report, eye.pictures

    def _changed(self, controller: Controller, tool: ToolPlan) -> ToolReport:
        person = AssistedOperator.with_eyes(
            InProcessEyes(self.simulator),
            lambda text: say(f"  {text}"),
            tool=lambda: TOOL,
            clock=controller.clock,
        )
        plan = ChangePlan((tool,), ask_before_write=False)
        change = NozzleChange(controller, plan, operator=person, listener=_Shown())
        (report,) = change.run().tools
        return report


class _Shown(Listener):
    def proposed(self, proposals: Sequence[Proposal]) -> None:
        for proposal in proposals:
            show_proposal(proposal)
