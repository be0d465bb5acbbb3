"""A simulated EPSON controller as a device: clients connect, bytes come, time passes.

Theory of operation. The device is given every instant at which something can change, in
order: the statement that runs, replies that leave late, time-outs, planned stops. It owns no
thread and no clock; whoever hosts it holds :attr:`EpsonSimulator.lock`, hands it bytes and
the time, and asks when to call again.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from robolink.model import Secret
from robolink.protocols.epson_binary import Dialect
from robolink.protocols.epson_text import StatusFlags
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.device.wire_record import MotionLog
from robolink_simulators.device.wire_time import late_random
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.condition import Condition, Mode
from robolink_simulators.epson.flash import Flash, moment_of, put_back
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.variables import Variables, project_variables
from robolink_simulators.epson.options import ControllerCard, EpsonOptions, serial_dialect
from robolink_simulators.epson.panel import EpsonMishaps, EpsonPanel
from robolink_simulators.epson.remote.command_window import SpelWindow
from robolink_simulators.epson.remote.commands import Alarms, CommandDesk
from robolink_simulators.epson.remote.link import ClientSlot, EpsonServerLink, OpenLinks
from robolink_simulators.epson.spel import Interpreter
from robolink_simulators.epson.spel.programs.program_load import load_project
from robolink_simulators.epson.spel.tasks.ports import Ports
from robolink_simulators.epson.spel.tasks.runner import ProgramRunner
from robolink_simulators.epson.stepped_controller import Companion, SteppedController
from robolink_simulators.epson.world import World
from robolink_simulators.faults import Fault, FaultPlan
from robolink_simulators.faults.links import EPSON_LINKS
from robolink_simulators.state_files import StateNotKeptError, drawn_serial


class EpsonSimulator(SteppedController):
    r"""Implements ``hosting.addresses.WireDevice``.

    Args:
        robot: Name of a model, as in docs/reference/epson-robots.md, "Families"; several, with
            commas between, for a controller with several robots.
        seed: Decides the world and every scatter; the same seed gives the same run, but for
            the serial number.
        password: Of Remote Ethernet; none means an empty one.
        options: The controller's habits.
        serial: Serial number of the robot; by default one that no other simulator has.
        state_path: File that keeps what the controller's flash keeps, the serial number too.
        faults: What is planned to go wrong.
        world: What goes wrong around the robot.
        answer_ms: How long after a request arrives its answer leaves, in simulated milliseconds.

    The motors are on at first, as in a cell that stands ready; after a restart they are off.

    Attributes:
        options: The controller's habits.
        machine: The robot and its memory.
        condition: What GetStatus shows.
        panel: What a person, or the rest of the cell, can do to the controller.
        alarms: The alarms that stand.
        card: What it says of itself.
        variables: The Global Preserve variables.
        worlds: The truth around each robot, and the person there.
        faults: What is planned to go wrong.
        starts: How often it was switched on.
        program: The program that is loaded, if any; without one Start shows a running task only.

    Raises:
        ConfigError: No such robot, or a state file that does not fit.

    Example:
        >>> from robolink_simulators.epson import EpsonSimulator
        >>> controller = EpsonSimulator("T3-401S", seed=2)
        >>> link = controller.connect(now_ns=0)
        >>> link.receive(b'$Login\r\n$Execute,"Print 6 * 7"\r\n', now_ns=0)
        >>> link.outgoing()
        b'#Login,0\r\n#Execute,"42\r\n"\r\n'
    """

    kind = "epson"
    _mishaps: EpsonMishaps
    machine: Machine
    worlds: tuple[World, ...]
    variables: Variables
    panel: EpsonPanel
    alarms: Alarms
    card: ControllerCard
    program: ProgramRunner | None
    starts: int

    def __init__(
        self,
        robot: str = "T6-602S",
        *,
        seed: int = 1,
        password: Secret | None = None,
        options: EpsonOptions | None = None,
        serial: str = "",
        state_path: Path | None = None,
        faults: Iterable[Fault] = (),
        world: WorldParameters | None = None,
        answer_ms: float = 0.0,
    ) -> None:
        super().__init__(seed, answer_ms=answer_ms)
        self.options = options or EpsonOptions()
        self.faults = FaultPlan(faults, seed, links=EPSON_LINKS)
        self.durable = state_path is not None
        self._models = tuple(map(find_robot, robot.split(",")))
        self._password = password.reveal() if password else ""
        self._state_path = state_path
        self._parameters = world
        self._links = OpenLinks()
        self._serial = serial or drawn_serial()
        if state_path is not None or world is not None:
            self._begin()  # refuses a file or world that does not fit
            self._flash.save_changes()  # refuses a file that cannot be written
        else:
            self.__class__ = _made_late(type(self))

    def _begin(self) -> None:
        self._begun = True
        self._make(self._serial)
        self._count_on()  # the file's contents were written earlier
        self.machine.advance(self.now_ns)

    def _make(self, serial: str) -> None:
        """Make the controller and its world, as they are at first."""
        model, *others = self._models
        bits = self.options.io_bits
        self.machine = Machine(model, serial=serial, others=others, io_bits=bits)
        self.machine.switch_all_motors(True)
        self.worlds = tuple(
            World.seeded(
                self.machine.inputs,
                one,
                self.seed,
                pendant_live=lambda: self.condition.mode is Mode.TEACH,
                now_ns=lambda: self.now_ns,
                parameters=self._parameters,
            )
            for one in self.machine.robots
        )
        self._flash = Flash(self._state_path, self.machine)
        self._flash.restore()
        self.starts = 1
        self.variables = project_variables(str(self.options.true_value))
        self._companion = (
            Companion(self.machine, self.variables) if self.options.companion else None
        )
        self.alarms, self.card = Alarms(), ControllerCard()
        self.condition = Condition(monitoring_only=self.options.monitoring_only)
        interpreter = Interpreter(
            self.machine,
            self.options,
            late_random(f"arm {self.seed}"),
            condition=self.condition,
            variables=self.variables,
            messages=self.card.messages,
        )
        self._session = interpreter.session
        self._session.project_name = self.card.project
        self.program = None
        self._window = SpelWindow(interpreter, self.condition, self.options)
        self._slot = ClientSlot(self.options.remote_timeout_s, self.wire_time)
        held = (self.variables, self.alarms, self.card)
        self._desk = CommandDesk(self.machine, self.condition, *held, options=self.options)
        parts = (self.machine, self.condition, self._window, self._slot, self.alarms)
        self.panel = EpsonPanel(*parts, options=self.options, acting=self.acting)
        self._mishaps = EpsonMishaps(self.panel, self.restart)

    @property
    def world(self) -> World:
        """The truth around the current robot, and the person at the cell."""
        return self.worlds[self.machine.robot_number - 1]

    def load(
        self,
        programs: Sequence[Path],
        points: Sequence[Path] = (),
        *,
        ports: Mapping[int, tuple[str, int]] | None = None,
        encoding: str | None = None,
    ) -> ProgramRunner:
        r"""Load a project in place of the earlier one: Start,n runs its function mainN.

        Args:
            programs: Its .prg files, or the .sprj file that lists them; IOLabels.dat and
                UserErrors.dat are taken from beside them.
            points: Its .pts files.
            ports: Where its TCP/IP ports lead whatever SetNet says.
            encoding: The code page of its files; without it UTF-8, code page 932 and GBK are tried.

        Raises:
            ProgramRefused: It cannot be built.
            ConfigError: A file cannot be read, or what is to begin in the background cannot.

        Example:
            >>> from pathlib import Path
            >>> from robolink_simulators.epson import EpsonSimulator
            >>> controller, main = EpsonSimulator(), Path("Main.prg")
            >>> _ = main.write_text("Function main\n  Wait 2\n  On 5\nFend\n")
            >>> _ = controller.load([main])
            >>> controller.panel.start_production()
            >>> for now_s in (1, 3):
            ...     controller.advance(now_s * 1_000_000_000)
            ...     print(controller.machine.outputs.get(5))
            False
            True
        """
        with self.acting():
            project = load_project(self._session, programs, points, encoding)
            if self.program is not None:
                self.program.forget()
            self.program = ProgramRunner(self._session, self.condition, project, Ports(ports))
            if "robolink_begin" in project.preserved():
                self._companion = None  # the real one is part of the project
            self._desk.starter = self.program.starter(lambda: self.now_ns)
            self.panel.starter = self._desk.starter
            self.program.begin_background(self.now_ns)
            return self.program

    def status_flags(self) -> StatusFlags:
        """Return the flags as they are, whatever the client sees."""
        return self.condition.flags(executing=self._window.busy)

    def connect(self, now_ns: int) -> EpsonServerLink:
        """Accept one client; see ``EpsonOptions.second_client``."""
        return self._connected(None, now_ns)

    def connect_serial(self, now_ns: int) -> EpsonServerLink:
        """Listen at a serial line for a client that turns Remote RS232 on."""
        return self._connected(serial_dialect(self.options), now_ns)

    def _connected(self, dialect: Dialect | None, now_ns: int) -> EpsonServerLink:
        self.advance(now_ns)
        link = EpsonServerLink(self, now_ns, dialect=dialect)
        self._links.add(link)
        self._after_act()  # a client that never logs in is cut off at an unforeseen time
        if self._slot.client is not None and self.options.second_client == "closed":
            link.cut()
        return link

    @property
    def machine_name(self) -> str:
        """Kind, and the models of its robots."""
        return " ".join((self.kind, *(model.name for model in self._models)))

    @property
    def robot_name(self) -> str:
        """Name of the model of robot 1; reading it makes nothing."""
        return self._models[0].name

    def _counted(self) -> dict[str, int]:
        return {
            "moves_started": self.machine.motions.added,
            "tool_writes": self.machine.flash_writes,
            "starts": self.starts,
            "touches": sum(world.operator.touches for world in self.worlds),
        }

    def _motion_log(self) -> MotionLog:
        return self.machine.motions

    def restart(self) -> None:
        """Switch off and on: links are cut, everything except flash and variables is lost."""
        with self.acting():
            self.starts += 1
            self._links.cut()
            self._window.interrupt(self.now_ns)
            if self.program is not None:
                self.program.forget()
            self._slot.free()
            self._mishaps.forget()
            self.condition.restart()
            self.machine.forget_volatile(self.now_ns)
            self._window.restart()
            if self.program is not None:
                self.program.begin_background(self.now_ns)

    def push(self, data: bytes) -> None:
        """Send every client bytes without a request (F10)."""
        with self.acting():
            self._links.push(data)

    def _truth(self) -> dict[str, Any]:
        return self.world.truth()

    @property
    def failure(self) -> StateNotKeptError | None:
        """Why it can no longer store its state; ``None`` while it can."""
        return self._flash.failure if self.durable else None

    @property
    def executes_program(self) -> bool:
        """Whether a SPEL+ program was loaded, whose variables no snapshot holds."""
        return self.program is not None

    def _renew(self) -> None:
        self._links.cut()
        self.faults.forget()
        self._make(drawn_serial())

    def _moment(self) -> dict[str, Any]:
        return moment_of(self.machine, self.variables, self.worlds)

    def _restore(self, held: Mapping[str, Any]) -> None:
        put_back(held, self.machine, self.variables, self.worlds, now_ns=self.now_ns)


@cache
def _made_late(kind: type[EpsonSimulator]) -> type[EpsonSimulator]:
    """Return the class of a controller that makes itself at first use, and then is of its own kind.

    A process serves thousands, of which few are ever used; so what stands in ``_make`` costs
    nothing until then. It is what it would be, had it been made at once. Afterwards nothing is left
    that would look at each attribute that is found.
    """

    def missing(self: EpsonSimulator, name: str) -> Any:  # noqa: ANN401 - whatever a controller has
        if not name.startswith("__"):
            with self.lock:
                if not self._begun:
                    self._begin()
                    self.__class__ = kind
                if name in self.__dict__:
                    return self.__dict__[name]
        raise AttributeError(name, name=name, obj=self)

    return type(kind.__name__, (kind,), {"__module__": kind.__module__, "__getattr__": missing})
