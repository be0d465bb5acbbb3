"""An EPSON controller whose own program measures and changes a needle, and asks for a verdict."""

import random
from typing import Final, cast

from robolink.calibration_run import ChangeReport
from robolink.errors import JournalError, NotReadyError, NotReadyReason, RobolinkError
from robolink.model import Controller, OutcomeLog, ToolOffset
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.workplace import exchanged
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.soak.calling_back.program import CONTACT, Production
from robolink_simulators.soak.calling_back.service import ProgramService
from robolink_simulators.soak.computer import VirtualProcess
from robolink_simulators.soak.history import Disturbance, Habit, Hindrance, Hour
from robolink_simulators.soak.people import Tell, put_right
from robolink_simulators.soak.plant.epson import EpsonPlant
from robolink_simulators.soak.plant.machine import WireTap
from robolink_simulators.soak.threads import TurnTaking

_NOMINAL: Final = ToolOffset(12.0, -3.5, -20.0)
_BUMP_MM: Final = 0.16
_BESIDE_MM: Final = 0.8


class ProgramPlant(EpsonPlant):
    """An EPSON SCARA in whose cell nobody but its own program moves and writes.

    Args:
        clock: The virtual time.
        tap: Told of everything on the wire.
        seed: Decides its world.
        turns: Knows whose process runs.
    """

    kind = "epson"
    moved_by_robolink = False
    calls_back = True
    models = "T6-602S"
    world = WorldParameters(contact_input=CONTACT)

    def __init__(self, clock: ManualClock, tap: WireTap, seed: int, turns: TurnTaking) -> None:
        super().__init__(clock, tap, seed)
        self._rng = random.Random(f"needles {seed}")
        # What a PC finds that recovers, as docs/spel-callback.md has the service told.
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
        """Note what the screen of the service shows, as far as it is about the journal."""
        if isinstance(error, JournalError):
            self._shown = error

    def prepare(self, person: WorldParameters) -> None:
        """Put another needle on, and teach where it touches the pin."""
        del person  # nobody is asked anything
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
        """Let the program put its tool back, and measure once more, undisturbed."""
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
        assert process is not None  # noqa: S101 - for the type: it has just answered
        outcomes = process.log_of(self.address, self.clock)
        try:
            with super().connect(process, outcomes) as controller:
                put_right(controller, habit, tell)
        finally:
            super().hang_up(process)

    def hang_up(self, process: VirtualProcess) -> None:
        """The line of a service that died is closed by the system."""
        if self._service.process is process:
            self._service.end()

    @property
    def movements(self) -> int:
        """None is begun by robolink."""
        return 0

    def arm(self, disturbance: Disturbance) -> None:
        """Plan what happens to the line, to the controller, or to the pin."""
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
        """Forget what was planned; return how much was met."""
        return self._service.acts.clear() + self._production.disarm()

    def repair(self) -> None:
        """See :meth:`EpsonPlant.repair`; the motors are on again."""
        super().repair()
        self._production.switch_on()


class _Served:
    """What stands where a controller stands in other cells: a service that runs."""

    def __init__(self, service: ProgramService, outcomes: OutcomeLog) -> None:
        self._service = service
        self.outcomes = outcomes

    def __enter__(self) -> "_Served":
        return self

    def __exit__(self, *_error: object) -> None:
        self._service.end()
