"""A simulated cell with two crossed beams and a touch plate, and a change of its nozzle."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.tip_switches import STANDING, LightBeam, TipSwitch, TouchPlate
from robolink_simulators.cell.workplace import XyzMm
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator
from robolink_simulators.testkit.media import served

import robolink
from robolink.calibration import Beam
from robolink.calibration_run import (
    AcceptanceCriteria,
    ChangePlan,
    Listener,
    NozzleChange,
    PlannedStep,
    ToolPlan,
    preview,
)
from robolink.model import Controller, InputEdge, Pose, ToolOffset
from robolink.procedures import TipSource
from robolink.runner import Ask, Look, Move, Question, Seek, StepDone
from robolink.stations import BeamStation, TouchStation

TOOL = 1
HEADINGS = (3.0, 88.0)
BEAM_INPUTS = (3, 4)
PLATE_INPUT = 5


class NobodyThere:
    """An operator who reads messages and must never be asked."""

    def tell(self, text: str) -> None:
        """Accept a message."""

    def ask(self, question: str, kind: Question) -> None:
        """Fail: nobody must be asked."""
        raise AssertionError(f"{kind}: {question}")

    def poll(self, wait_s: float) -> str | None:
        """Fail: nobody must be asked."""
        raise AssertionError(f"nobody was asked, for {wait_s} s")


@dataclass(frozen=True)
class EitherOf:
    """Several sensors on one input."""

    switches: tuple[TipSwitch, ...]

    def trips(self, tip_mm: XyzMm, shaft: tuple[float, float, float] = STANDING) -> bool:
        """Return whether any of them trips."""
        return any(switch.trips(tip_mm, shaft) for switch in self.switches)


@dataclass(frozen=True)
class Inverted:
    """A sensor whose input goes off when it trips."""

    switch: TipSwitch

    def trips(self, tip_mm: XyzMm, shaft: tuple[float, float, float] = STANDING) -> bool:
        """Return whether it does not trip."""
        return not self.switch.trips(tip_mm, shaft)


@dataclass(frozen=True)
class Taken:
    """A step without a question, and the pose after it."""

    step: Move | Seek | Look
    pose: Pose

    @property
    def edge(self) -> InputEdge | None:
        """The edge that the step sought."""
        return self.step.edge if isinstance(self.step, Seek) else None


@dataclass
class Followed(Listener):
    """A listener that records the steps."""

    steps: list[Taken] = field(default_factory=list)

    def step(self, tool: int, done: StepDone) -> None:
        """Record a step."""
        assert tool == TOOL
        assert not isinstance(done.step, Ask)
        if done.pose is None or not isinstance(done.step, (Move, Seek, Look)):
            return
        self.steps.append(Taken(done.step, done.pose))

    @property
    def edges(self) -> list[Taken]:
        """The steps that sought an edge."""
        return [taken for taken in self.steps if taken.edge is not None]


@dataclass
class SensorCell:
    """A cell with sensors, and its true data.

    Attributes:
        place_mm: Where the beams cross.
        plate: The place where the plate is touched.
    """

    simulator: Any
    url: str
    clock: ManualClock

    def __post_init__(self) -> None:
        x_mm, y_mm, z_mm = self.simulator.world.tip_mm()
        self.place_mm: XyzMm = (x_mm + 4.0, y_mm - 4.0, z_mm - 6.0)
        self.plate = TouchStation(x_mm - 5.0, y_mm + 5.0, z_mm - 7.0, PLATE_INPUT)

    @property
    def station(self) -> BeamStation:
        """The reference record of the beams."""
        x_mm, y_mm, z_mm = self.place_mm
        first, second = (Beam(x_mm, y_mm, heading) for heading in HEADINGS)
        return BeamStation((first, second), z_mm, BEAM_INPUTS)

    def beams(self, **shape: float) -> tuple[LightBeam, LightBeam]:
        """Return the beams at their real places."""
        first, second = (LightBeam(self.place_mm, heading, **shape) for heading in HEADINGS)
        return first, second

    def mount_beams(self, beams: tuple[TipSwitch, TipSwitch], **wiring: float) -> None:
        """Connect two sensors to the inputs of the beams."""
        for number, beam in zip(BEAM_INPUTS, beams, strict=True):
            self.simulator.world.connect(number, beam, **wiring)

    def mount_plate(self, **wiring: float) -> None:
        """Connect a plate to its input."""
        self.simulator.world.connect(PLATE_INPUT, TouchPlate(self.plate.z_mm), **wiring)

    @property
    def truth(self) -> ToolOffset:
        """The real place of the mounted nozzle's tip."""
        tip: ToolOffset = self.simulator.world.tips[TOOL]
        return tip

    @property
    def stored(self) -> ToolOffset | None:
        """The stored offset."""
        offset: ToolOffset | None = self.simulator.machine.tools.get(TOOL)
        return offset

    @property
    def tip_z_mm(self) -> float:
        """The present height of the tip."""
        height_mm: float = self.simulator.world.tip_mm()[2]
        return height_mm

    def change(self, source: TipSource, listener: Listener | None = None, **plan: Any) -> Any:
        """Return a nozzle change that asks nobody."""
        one = ToolPlan(TOOL, source, AcceptanceCriteria(**plan))
        return lambda controller, write=True: (
            NozzleChange(
                controller,
                ChangePlan((one,), ask_before_write=False),
                operator=NobodyThere(),
                listener=listener,
            )
            .run(write=write)
            .tools[0]
        )

    def foresee(self, controller: Controller, source: TipSource) -> tuple[PlannedStep, ...]:
        """Return the planned steps of a measurement."""
        return preview(controller, ChangePlan((ToolPlan(TOOL, source),)))

    @contextmanager
    def connected(self) -> Iterator[Controller]:
        """Connect."""
        with robolink.connect(self.url) as controller:
            yield controller

    def run(self, source: TipSource, listener: Listener | None = None, **options: Any) -> Any:
        """Change the nozzle and return the tool's report."""
        write = options.pop("write", True)
        with self.connected() as controller:
            return self.change(source, listener, **options)(controller, write=write)


@contextmanager
def sensor_cell(seed: int = 3, **habits: Any) -> Iterator[SensorCell]:
    """Set up a cell around an EPSON controller; ``habits`` are arguments of its simulator."""
    simulator, clock = EpsonSimulator(seed=seed, **habits), ManualClock()
    with served(simulator, clock=clock) as url:
        yield SensorCell(simulator, url, clock)


@contextmanager
def plc_sensor_cell(seed: int = 3) -> Iterator[SensorCell]:
    """Set up a cell around a PLC."""
    simulator, clock = SoftMotionSimulator(seed=seed), ManualClock()
    with served(simulator, clock=clock) as url:
        yield SensorCell(simulator, url, clock)


def miss_mm(found: ToolOffset, true: ToolOffset) -> float:
    """Return the error of an offset in X and Y."""
    return math.hypot(found.x_mm - true.x_mm, found.y_mm - true.y_mm)


def shifted(beam: LightBeam, dx_mm: float) -> LightBeam:
    """Return a beam at a shifted place."""
    x_mm, y_mm, z_mm = beam.through_mm
    return replace(beam, through_mm=(x_mm + dx_mm, y_mm, z_mm))
