"""sim epson: serving a simulated EPSON controller."""

import os
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

import click
from robolink_simulators.assist.port import serve_assist
from robolink_simulators.cell.clock import SteeredClock
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.options import options_from_text, read_profile
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


def load_programs(
    simulator: EpsonSimulator,
    programs: Sequence[Path],
    points: Sequence[Path],
    vision: Path | None = None,
) -> None:
    """Load a project, if any; what its tasks print is shown beside the announcement.

    Args:
        simulator: Into which.
        programs: Its programs.
        points: Its point files.
        vision: Its vision project.

    Raises:
        ConfigError: It cannot be built, or a file cannot be read.
        click.UsageError: There are points or a vision project, and no programs.
    """
    if not programs:
        if points:
            raise click.UsageError(tr("--points goes with --program."))
        if vision is not None:
            raise click.UsageError(tr("--vision goes with --program."))
        return
    runner = simulator.load(programs, points)
    if vision is not None:
        install_vision(simulator, vision)
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
        tr("Ctrl-C ends it."),
    )
    announce(document, lines, state_dir)
