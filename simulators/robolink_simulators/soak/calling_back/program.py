"""The production program of a cell, run statement by statement in virtual time."""

import math
import random
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from robolink_cli.commands.companions.companion_files import companion_texts

from robolink.model import Pose
from robolink.timing import NS_PER_S
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.tasks.runner import ProgramRunner
from robolink_simulators.soak.calling_back.service import ProgramService
from robolink_simulators.soak.history import Disturbance
from robolink_simulators.soak.plant.counted_acts import CountedActs

CONTACT: Final = 8
MEASURED_DEG: Final = (-60.0, -20.0, 20.0, 60.0, 90.0)
PROVED_DEG: Final = (75.0, -75.0)
FIRST_MEASURED, FIRST_PROVED = 11, 21
_NOISE_MM: Final = 0.003
_LONGEST_S: Final = 1200
_STATEMENTS: Final = 40
"""Within so many statements of a question the power goes."""

_MAIN: Final = f"""\
Function main
  RobolinkRestore
  Tool 1
  If RobolinkOpen("127.0.0.1", 5001) Then
    If RobolinkBegin(1, "n-angle") Then
      If TouchAll({FIRST_MEASURED}, {FIRST_MEASURED + len(MEASURED_DEG) - 1}) Then
        If RobolinkWrite() Then
          If TouchAll({FIRST_PROVED}, {FIRST_PROVED + len(PROVED_DEG) - 1}) Then
            If RobolinkFinish() Then
              Print "kept"
            EndIf
          EndIf
        EndIf
      EndIf
    EndIf
  EndIf
  RobolinkClose
  Print rl_code$
Fend
Function main2
  RobolinkRestore
  Tool 1
Fend
Function TouchAll(first As Integer, last As Integer) As Boolean
  Integer i
  TouchAll = True
  For i = first To last
    Tool 0
    Go P(i) +Z(3)
    RobolinkApproach({CONTACT})
    Go P(i)
    If TouchAll Then
      TouchAll = RobolinkTouch({CONTACT})
    EndIf
    Go P(i) +Z(3)
    Tool 1
  Next i
Fend
"""


class _PowerGone(BaseException):
    """The controller loses its power before this statement."""


class Production:
    """A controller's program, and what happens to the controller while it runs.

    Args:
        simulator: The controller.
        clock: The virtual time.
        service: Answers the program.
        rng: Of the needle's touches.

    Attributes:
        acts: What happens to the controller, counted by questions.
    """

    def __init__(
        self,
        simulator: EpsonSimulator,
        clock: ManualClock,
        service: ProgramService,
        rng: random.Random,
    ) -> None:
        self.acts = CountedActs()
        self._simulator = simulator
        self._clock = clock
        self._service = service
        self._rng = rng
        self._statements_left: int | None = None
        self._stopping = False
        self._runner = self._loaded()
        service.on_question = self._questioned

    def _loaded(self) -> ProgramRunner:
        with tempfile.TemporaryDirectory(prefix="soak-program-") as folder:
            companion, main = Path(folder) / "recal.prg", Path(folder) / "main.prg"
            companion.write_bytes(companion_texts()["recal.prg"])
            main.write_text(_MAIN, encoding="ascii")
            runner = self._simulator.load([companion, main])
        runner.ports.dial = self._service.dial
        return runner

    def teach(self, *, proof_only: bool = False) -> None:
        """Put points where the tip is on the pin, as the program's own search finds them."""
        if not proof_only:
            self._teach(FIRST_MEASURED, MEASURED_DEG)
        self._teach(FIRST_PROVED, PROVED_DEG)

    def teach_beside(self, which: int, off_mm: float) -> None:
        """Let one touch find the pin beside where it is."""
        angles = (*MEASURED_DEG, *PROVED_DEG)
        index = which % len(angles)
        first = FIRST_MEASURED + index
        if index >= len(MEASURED_DEG):
            first = FIRST_PROVED + index - len(MEASURED_DEG)
        self._teach(first, angles[index : index + 1], off_mm=off_mm)

    def run(self) -> str:
        """Let the program run to its end; return the last that it prints."""
        self._runner.console.clear()
        self._simulator.panel.start_production()
        self._go_on()
        printed = "".join(self._runner.console).split()
        return printed[0] if printed else ""

    def restore(self) -> None:
        """Let the program put back what was not proved, and do nothing else."""
        self._simulator.advance(self._clock.now_ns())
        self._runner.start("main2", self._simulator.now_ns)
        self._go_on()

    def switch_on(self) -> None:
        """Switch the motors on, after whatever happened."""
        self._simulator.machine.switch_all_motors(True)

    def disarm(self) -> int:
        """Plan nothing any more; return how much was met."""
        self._statements_left, self._stopping = None, False
        return self.acts.clear()

    def _go_on(self) -> None:
        end_ns = self._clock.now_ns() + _LONGEST_S * NS_PER_S
        while self._runner.tasks and self._clock.now_ns() < end_ns:
            change = self._simulator.next_change()
            self._clock.advance_to(end_ns if change is None else change)
            try:
                self._simulator.advance(self._clock.now_ns())
            except _PowerGone:
                self._lose_power()
            if self._stopping:
                self._stopping = False
                self._simulator.panel.press_estop()
            self._service.beat()
        if self._runner.tasks:
            message = "the program hangs"
            raise RuntimeError(message)

    def _questioned(self, text: str) -> None:
        for disturbance in self.acts.due(text):
            if disturbance.what == "ESTOP":
                self._stopping = True
            else:
                self._cut_after(disturbance)

    def _cut_after(self, disturbance: Disturbance) -> None:
        self._statements_left = self._rng.randrange(_STATEMENTS) + (disturbance.position or 0)
        self._runner.on_statement = self._count

    def _count(self, _task: object, _file: str, _line: int, _text: str) -> None:
        if self._statements_left is None:
            return
        self._statements_left -= 1
        if self._statements_left < 0:
            self._statements_left = None
            raise _PowerGone

    def _lose_power(self) -> None:
        self._runner.on_statement = None
        self._runner.forget()  # not one statement more, whatever the switch lets pass before it
        self._simulator.restart()
        self.switch_on()

    def _teach(self, first: int, angles: Sequence[float], *, off_mm: float = 0.0) -> None:
        world = self._simulator.world
        true, pin = world.tips[1], world.pin_mm
        hand = self._simulator.machine.arm.flange().hand
        for number, aimed_deg in enumerate(angles, start=first):
            u_deg = aimed_deg + self._rng.uniform(-2, 2)
            c, s = math.cos(math.radians(u_deg)), math.sin(math.radians(u_deg))
            pose = Pose(
                x_mm=pin[0] + off_mm - (c * true.x_mm - s * true.y_mm) + self._scatter(),
                y_mm=pin[1] - (s * true.x_mm + c * true.y_mm) + self._scatter(),
                z_mm=pin[2] - true.z_mm - 0.01,
                u_deg=u_deg,
                hand=hand,
            )
            self._simulator.machine.points.store(number, Point.at(pose))

    def _scatter(self) -> float:
        return self._rng.gauss(0, _NOISE_MM)
