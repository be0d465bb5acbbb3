"""sim epson: serving a simulated EPSON controller."""

import os
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import click
from robolink_simulators.assist.port import serve_assist
from robolink_simulators.cell.clock import SteeredClock
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.options import options_from_text, read_profile
from robolink_simulators.epson.spel.tasks.channels.serial_link import COM_NUMBERS
from robolink_simulators.epson.vision.vision_file import install_vision
from robolink_simulators.hosting.streams.epson_serial import serve_serial
from robolink_simulators.hosting.streams.epson_tcp import serve_tcp

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Secret
from robolink_cli.commands.simulate.serving import (
    Termination,
    announce,
    controlled,
    named_values,
)
from robolink_cli.console.render import note
from robolink_cli.options.simulation import ServedLife


def serve_epson(
    simulator: EpsonSimulator,
    address: tuple[str, int] | None,
    *,
    speed: float,
    allow_remote: bool,
    life: ServedLife,
    baud: int = 0,
) -> None:
    """Serve a simulator, its assist port and its control API until SIGTERM or Ctrl-C.

    Args:
        simulator: What to serve.
        address: Where Remote Ethernet listens; ``None`` for a serial line in its place.
        speed: How many times faster than real the simulated time passes.
        allow_remote: Whether an address that other machines can reach is taken.
        life: Where it is controlled, and when it ends by itself.
        baud: How fast the serial line is; 0 for at once.
    """
    clock = SteeredClock(speed)
    with ExitStack() as stack:
        stopped = stack.enter_context(Termination(life))
        if address is None:
            url = stack.enter_context(serve_serial(simulator, baud=baud, clock=clock)).url
        else:
            tcp = serve_tcp(simulator, *address, clock=clock, allow_remote=allow_remote)
            url = stack.enter_context(tcp).url
        assist = stack.enter_context(serve_assist(simulator, clock=clock))
        cell = ControlledCell(simulator, clock, {"serial" if address is None else "tcp": url})
        control = stack.enter_context(controlled({"cell": cell}, life, allow_remote=allow_remote))
        beside = {"assist": assist.url, "control": control.url_of("cell")}
        _announce(simulator, url, beside, stopped.state_dir)
        stopped.wait(lambda: simulator.log.added + control.requests)


@dataclass(frozen=True, slots=True)
class ProjectSurroundings:
    """What a project needs beside its files: what ``--vision``, ``--com`` and ``--files`` name.

    Attributes:
        vision: The vision project.
        lines: Serial lines, as they were typed.
        folder: Where files lie.
    """

    vision: Path | None = None
    lines: Sequence[str] = ()
    folder: Path | None = None

    @property
    def named(self) -> str | None:
        """The first of the options that was given, ``None`` where none was."""
        given = (("--vision", self.vision), ("--com", self.lines), ("--files", self.folder))
        return next((option for option, value in given if value), None)

    def install(self, simulator: EpsonSimulator) -> None:
        """Give them to a simulator whose program is loaded.

        Raises:
            ConfigError: The vision project makes no sense.
            click.UsageError: A serial line makes none.
        """
        runner = simulator.program
        assert runner is not None  # noqa: S101 - loaded before
        runner.ports.devices |= _lines(self.lines)
        if self.folder is not None:
            runner.session.files.root = self.folder
        if self.vision is not None:
            install_vision(simulator, self.vision)


def load_programs(
    simulator: EpsonSimulator,
    programs: Sequence[Path],
    points: Sequence[Path],
    surroundings: ProjectSurroundings,
) -> None:
    """Load a project, if any; what its tasks print is shown beside the announcement.

    Args:
        simulator: Into which.
        programs: Its programs.
        points: Its point files.
        surroundings: Its camera, serial lines and folder.

    Raises:
        ConfigError: It cannot be built, or a file cannot be read.
        click.UsageError: There is something that goes with programs, and no programs.
    """
    if not programs:
        named = "--points" if points else surroundings.named
        if named is not None:
            raise click.UsageError(tr("{option} goes with --program.", option=named))
        return
    runner = simulator.load(programs, points)
    surroundings.install(simulator)
    runner.on_print = lambda text: note(text.rstrip("\r\n"))


def password_in(variable: str | None) -> Secret | None:
    """Return the password in an environment variable, ``None`` when none is named.

    Raises:
        ConfigError: The variable holds none.
    """
    if variable is None:
        return None
    value = os.environ.get(variable)
    if not value:
        raise ConfigError(
            tr("The environment variable {variable} holds no password.", variable=variable),
            remedy=tr("Set it first, or leave --password-env out."),
        )
    return Secret(value)


def habits(options: Sequence[str], profile: Path | None) -> EpsonOptions:
    """Return the controller's habits: those of a cell profile, overruled by options.

    Raises:
        ConfigError: An option or the profile makes no sense.
    """
    pairs = named_values(options, "--option terminator=cr")
    settled = {} if profile is None else read_profile(profile)
    return options_from_text({**settled, **pairs})


def _announce(
    simulator: EpsonSimulator, url: str, beside: Mapping[str, str], state_dir: str
) -> None:
    robot, seed = simulator.machine.model.name, simulator.seed
    document: dict[str, object] = {"url": url, **beside, "robot": robot, "seed": seed}
    lines = (
        tr("SIMULATED EPSON {robot} (seed {seed}). No robot moves.", robot=robot, seed=seed),
        tr("  controller  {url}", url=url),
        tr("  assist      {url}", url=beside["assist"]),
        tr("  control     {url}", url=beside["control"]),
        tr('Try: robolink -c "{url}" status', url=url),
        tr("From the tip to the pin, seen now: robolink sim assist ASSIST look"),
        tr("Ctrl-C ends it."),
    )
    announce(document, lines, state_dir)


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
