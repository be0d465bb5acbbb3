"""sim epson: serves a simulated EPSON controller."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import click
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.condition import SpelRefusal
from robolink_simulators.epson.options import options_from_text, read_profile
from robolink_simulators.epson.spel.tasks.ports import COM_NUMBERS
from robolink_simulators.epson.spel.tasks.runner import ProgramRunner, run_to_end
from robolink_simulators.epson.vision_file import install_vision
from robolink_simulators.faults import LinkKind
from robolink_simulators.hosting.streams.epson import serve_serial, serve_tcp

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.commands.simulate.service import (
    host_and_port,
    named_values,
    password_in,
    world_from,
)
from robolink_cli.commands.simulate.simulated_kind import SimulatedKind, plan_faults
from robolink_cli.console.render import note
from robolink_cli.options.simulation import tell_encoding


def make_epson(
    *,
    robot: str,
    seed: int,
    password_env: str | None,
    options: Sequence[str],
    profile: Path | None,
    state: Path | None,
    world: Sequence[str],
    programs: Sequence[Path],
    points: Sequence[Path],
    vision: Path | None,
    lines: Sequence[str],
    folder: Path | None,
    encoding: str | None,
    before: str | None,
    faults: Path | None,
    serial: str | None,
    answer_ms: float,
    cell: str = "",
    **_placing: Any,  # noqa: ANN401 - other options
) -> EpsonSimulator:
    """Make a simulator from the options of ``sim epson``, which explain each.

    ``cell`` is its name among several, for what it tells meanwhile.

    Raises:
        ConfigError: One of them makes no sense.
        click.UsageError: There is something that goes with programs, and no programs.
    """
    simulator = EpsonSimulator(
        robot,
        seed=seed,
        password=password_in(password_env, "--password-env"),
        options=habits(options, profile),
        state_path=state,
        world=world_from(world) if world else None,  # the default needs no check
        answer_ms=answer_ms,
    )
    surroundings = ProjectSurroundings(vision, lines, folder, encoding, before)
    load_programs(simulator, programs, points, surroundings, cell=cell)
    link = LinkKind.EPSON_SERIAL if serial else LinkKind.EPSON_TCP
    plan_faults(simulator, faults, {link}, cell=cell)
    return simulator


def _place(
    stack: ExitStack,
    simulator: EpsonSimulator,
    clock: ScaledClock,
    *,
    address: str,
    serial: str | None,
    baud: int,
    allow_remote: bool,
    **_making: Any,  # noqa: ANN401 - other options
) -> dict[str, str]:
    """Serve it with Remote Ethernet, or with Remote RS232 in its place."""
    if serial:
        line = stack.enter_context(serve_serial(simulator, baud=baud, clock=clock))
        return {"serial": line.url}
    listen = host_and_port(address, "--tcp")
    tcp = stack.enter_context(serve_tcp(simulator, *listen, clock=clock, allow_remote=allow_remote))
    return {"tcp": tcp.url}


def _title(simulator: EpsonSimulator) -> str:
    robot, seed = simulator.robot_name, simulator.seed
    return tr("SIMULATED EPSON {robot} (seed {seed}). No robot moves.", robot=robot, seed=seed)


_LONGEST_PREPARATION_S: Final = 60.0

EPSON_KIND: Final = SimulatedKind(
    make_epson,
    _place,
    lambda simulator: {"robot": simulator.robot_name},
    _title,
)
"""The simulator of ``sim epson``."""


@dataclass(frozen=True, slots=True)
class ProjectSurroundings:
    """What a project needs besides its files, from the options that go with programs.

    Attributes:
        vision: The vision project.
        lines: Serial lines, as they were typed.
        folder: Where files lie.
        encoding: The code page of its files.
        before: The function that runs first.
    """

    vision: Path | None = None
    lines: Sequence[str] = ()
    folder: Path | None = None
    encoding: str | None = None
    before: str | None = None

    @property
    def named(self) -> str | None:
        """The first of the options that was given, ``None`` where none was."""
        given = (
            ("--vision", self.vision),
            ("--com", self.lines),
            ("--files", self.folder),
            ("--encoding", self.encoding),
            ("--before", self.before),
        )
        return next((option for option, value in given if value), None)

    def load(
        self, simulator: EpsonSimulator, programs: Sequence[Path], points: Sequence[Path]
    ) -> ProgramRunner:
        """Load a project with them.

        Raises:
            ConfigError: It cannot be built, a file cannot be read, or the vision project makes no
                sense.
            click.UsageError: A serial line makes none.
        """
        runner = simulator.load(programs, points, encoding=self.encoding)
        tell_encoding(runner.project.encoding, named=self.encoding)
        runner.ports.devices |= _lines(self.lines)
        if self.folder is not None:
            runner.session.files.root = self.folder
        if self.vision is not None:
            install_vision(simulator, self.vision)
        return runner


def load_programs(
    simulator: EpsonSimulator,
    programs: Sequence[Path],
    points: Sequence[Path],
    surroundings: ProjectSurroundings,
    *,
    cell: str = "",
) -> None:
    """Load a project, if any; its tasks' output is shown beside the announcement.

    Args:
        simulator: Into which.
        programs: Its programs.
        points: Its point files.
        surroundings: Its camera, serial lines and folder.
        cell: Its name among several, which stands before what is printed.

    Raises:
        ConfigError: It cannot be built, or a file cannot be read.
        click.UsageError: There is something that goes with programs, and no programs.
    """
    if not programs:
        named = "--points" if points else surroundings.named
        if named is None and simulator.options.background_tasks:
            named = "--option background_tasks"
        if named is not None:
            raise click.UsageError(tr("{option} needs --program.", option=named))
        return
    runner = surroundings.load(simulator, programs, points)
    before = f"{cell}: " if cell else ""
    runner.on_print = lambda text: note(before + text.rstrip("\r\n"))
    if surroundings.before is not None:
        run_first(simulator, runner, surroundings.before)


def run_first(simulator: EpsonSimulator, runner: ProgramRunner, function: str) -> None:
    """Run the function that sets up what the project keeps outside its programs.

    Raises:
        ConfigError: It fails, or does not end.
        click.UsageError: There is none of that name.
    """
    start_function(runner, function, simulator.now_ns)
    ended = run_to_end(
        runner, simulator.advance, simulator.next_change, most_s=_LONGEST_PREPARATION_S
    )
    if runner.failure is not None or not ended:
        why = str(runner.failure) if runner.failure is not None else tr("it does not end")
        raise ConfigError(
            tr("{function}, named with --before, failed: {why}.", function=function, why=why),
            remedy=tr("Use only settings in it: HomeSet, TLSet, SetNet, SetCom, MemOn."),
        )


def start_function(runner: ProgramRunner, name: str, now_ns: int) -> None:
    """Start a function of a project.

    Raises:
        click.UsageError: There is none of that name without arguments.
    """
    try:
        runner.start(name, now_ns)
    except SpelRefusal as refusal:
        raise click.UsageError(
            tr("There is no function {name} without arguments.", name=name)
        ) from refusal


def habits(options: Sequence[str], profile: Path | None) -> EpsonOptions:
    """Return the controller's habits: those of a cell profile, overruled by options.

    Raises:
        ConfigError: An option or the profile makes no sense.
    """
    pairs = named_values(options, "--option terminator=cr")
    settled = {} if profile is None else read_profile(profile)
    return options_from_text({**settled, **pairs})


def _lines(texts: Sequence[str]) -> dict[int, str]:
    """Return the serial line of each port that ``--com`` names."""
    named = dict[int, str]()
    for text in texts:
        number, _, device = text.partition("=")
        if not device or number not in map(str, COM_NUMBERS):
            raise click.UsageError(
                tr("--com takes 1 to 4 or 1001 to 1008, and a device: 1=/dev/pts/3.")
            )
        named[int(number)] = device
    return named
