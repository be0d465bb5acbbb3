"""An EPSON controller whose own program measures, changes a needle, and asks for a verdict."""

import math
import random
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final, cast

from robolink_cli.commands.companions.spel import companion_texts
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.workplace import exchanged
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.tasks.runner import ProgramRunner

from robolink.calibration_run import ChangeReport
from robolink.errors import JournalError, NotReadyError, NotReadyReason, RobolinkError
from robolink.model import Controller, OutcomeLog, Pose, ToolOffset
from robolink.timing import NS_PER_S
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.history import CountedActs, Disturbance, Habit, Hindrance, Hour
from tests.soak.adversary.people import Tell, put_right
from tests.soak.adversary.plant.callback_service import ProgramService
from tests.soak.adversary.plant.epson import EpsonPlant
from tests.soak.adversary.plant.machine import WireTap
from tests.soak.adversary.surroundings import TurnTaking

CONTACT: Final = 8
MEASURED_DEG: Final = (-60.0, -20.0, 20.0, 60.0, 90.0)
PROVED_DEG: Final = (75.0, -75.0)
FIRST_MEASURED, FIRST_PROVED = 11, 21
_NOISE_MM: Final = 0.003
_LONGEST_S: Final = 1200
_STATEMENTS: Final = 40
"""The power fails within this many statements of a question."""

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
    """A controller's program, and the controller's faults while it runs.

    Args:
        simulator: The controller.
        clock: The virtual time.
        service: Answers the program.
        rng: Draws the needle's touches.

    Attributes:
        acts: The controller's planned faults, counted by questions.
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
        """Teach points with the tip on the pin, as the program's own search finds them."""
        if not proof_only:
            self._teach(FIRST_MEASURED, MEASURED_DEG)
        self._teach(FIRST_PROVED, PROVED_DEG)

    def teach_beside(self, which: int, off_mm: float) -> None:
        """Let one touch find the pin at a wrong place."""
        angles = (*MEASURED_DEG, *PROVED_DEG)
        index = which % len(angles)
        first = FIRST_MEASURED + index
        if index >= len(MEASURED_DEG):
            first = FIRST_PROVED + index - len(MEASURED_DEG)
        self._teach(first, angles[index : index + 1], off_mm=off_mm)

    def run(self) -> str:
        """Run the program to its end; return the last text that it prints."""
        self._runner.console.clear()
        self._simulator.panel.start_production()
        self._go_on()
        printed = "".join(self._runner.console).split()
        return printed[0] if printed else ""

    def restore(self) -> None:
        """Let the program restore the untested value, and do nothing else."""
        self._simulator.advance(self._clock.now_ns())
        self._runner.start("main2", self._simulator.now_ns)
        self._go_on()

    def switch_on(self) -> None:
        """Switch the motors on again."""
        self._simulator.machine.switch_all_motors(True)

    def disarm(self) -> int:
        """Drop all plans; return how many occurred."""
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
        self._runner.forget()  # not one statement more, whatever the switch still allows
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


_NOMINAL: Final = ToolOffset(12.0, -3.5, -20.0)
_BUMP_MM: Final = 0.16
_BESIDE_MM: Final = 0.8


class ProgramPlant(EpsonPlant):
    """An EPSON SCARA whose own program alone moves and writes.

    Args:
        clock: The virtual time.
        tap: Receives all wire traffic.
        seed: Decides its world.
        turns: Knows the running process.
    """

    kind = "epson"
    moved_by_robolink = False
    calls_back = True
    models = "T6-602S"
    world = WorldParameters(contact_input=CONTACT)

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int, turns: TurnTaking) -> None:
        super().__init__(clock, tap, seed)
        self._rng = random.Random(f"needles {seed}")
        # The findings of a PC that recovers, set up as docs/spel-callback.md says.
        serial = f"SOAK{seed:06d}"
        on_record = f"epson:C-{serial}/{serial}"
        self._service = ProgramService(clock, turns, tap.passed, on_record=on_record)
        self._service.on_value = self._given
        self._service.on_refusal = self._refused
        self._shown: JournalError | None = None
        self._production = Production(self.simulator, clock, self._service, self._rng)
        self._nominal_pin = self.simulator.world.pin_mm

    def _given(self, value: ToolOffset) -> None:
        self.values.append(value)
        self.tap.given(1, value)

    def _refused(self, _code: str, error: RobolinkError) -> None:
        """Note the service's messages about the journal."""
        if isinstance(error, JournalError):
            self._shown = error

    def prepare(self, person: WorldParameters) -> None:
        """Mount another needle, and teach the places where it touches the pin."""
        del person  # nobody is asked
        world = self.simulator.world
        world.pin_mm = self._nominal_pin
        world.tips[1] = exchanged(_NOMINAL, self._rng)
        self._production.teach()

    def connect(self, process: VirtualProcess, outcomes: OutcomeLog) -> Controller:
        """Let a process serve the program."""
        self._service.begin(process)
        return cast(Controller, _Served(self._service, outcomes))

    def carry_out(self, controller: Controller, hour: Hour, tell: Tell) -> ChangeReport | None:
        """Let the program run once; robolink answers."""
        del controller, hour
        tell(f"the program prints {self._production.run()}")
        return None

    def put_right(self, controller: Controller, habit: Habit, tell: Tell) -> bool:
        """Let the program restore its tool, and measure once more, undisturbed."""
        world = self.simulator.world
        world.pin_mm = self._nominal_pin
        self._production.teach()
        self._production.restore()
        self._shown = None
        printed = self._production.run()
        tell(f"the program prints {printed}")
        if self._service.lacks_record():
            self._recover(habit, tell)
        left = cast(_Served, controller).outcomes.open_markers()
        if printed != "kept" and self._shown is not None:
            raise self._shown  # the people do what it says
        if printed != "kept":
            raise NotReadyError(f"the program prints {printed!r}", reason=NotReadyReason.NOT_REMOTE)
        return not left

    def _recover(self, habit: Habit, tell: Tell) -> None:
        """Make the PC the control device and recover, as docs/spel-callback.md tells a person."""
        process = self._service.process
        assert process is not None  # for the type: it has just answered
        outcomes = process.log_of(self.address, self.clock)
        try:
            with super().connect(process, outcomes) as controller:
                put_right(controller, habit, tell)
        finally:
            super().hang_up(process)

    def hang_up(self, process: VirtualProcess) -> None:
        """Stop serving, as the system closes the line of a service that died."""
        if self._service.process is process:
            self._service.end()

    @property
    def movements(self) -> int:
        """Zero: robolink begins no movement."""
        return 0

    def arm(self, disturbance: Disturbance) -> None:
        """Plan a fault of the line, the controller or the pin."""
        if disturbance.kind is Hindrance.WIRE:
            self._service.acts.plan(disturbance)
            return
        match disturbance.what:
            case "PIN_BUMPED":
                x, y, z = self.simulator.world.pin_mm
                self.simulator.world.pin_mm = (x + _BUMP_MM, y, z)
                self._production.teach(proof_only=True)
                self._service.acts.met += 1
            case "TOUCH_BESIDE":
                self._production.teach_beside(disturbance.position or 0, _BESIDE_MM)
                self._service.acts.met += 1
            case _:
                self._production.acts.plan(disturbance)

    def disarm(self) -> int:
        """Drop the plans; return how many occurred."""
        return self._service.acts.clear() + self._production.disarm()

    def repair(self) -> None:
        """See :meth:`EpsonPlant.repair`; the motors are on again."""
        super().repair()
        self._production.switch_on()


class _Served:
    """A running service, in the place of another cell's controller."""

    def __init__(self, service: ProgramService, outcomes: OutcomeLog) -> None:
        self._service = service
        self.outcomes = outcomes

    def __enter__(self) -> "_Served":
        return self

    def __exit__(self, *_error: object) -> None:
        self._service.end()
