"""sim: serve a simulated controller for anybody's client."""

import json
import signal
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli._context import json_option
from robolink_cli._render import json_is_on
from robolink_cli._replaying import serve_recording

if TYPE_CHECKING:
    from robolink_simulators.epson import EpsonOptions, EpsonSimulator

    from robolink.model import Secret


@click.group()
@json_option
def sim() -> None:
    """Serve a simulated controller on this machine."""


@sim.command()
@click.option(
    "--tcp",
    "address",
    metavar="HOST:PORT",
    default="127.0.0.1:5000",
    show_default=True,
    help="Where to listen; port 0 takes a free one.",
)
@click.option("--robot", default="T6-602S", show_default=True, help="Model of the robot.")
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=1,
    show_default=True,
    help="Another cell, another tip.",
)
@click.option(
    "--password-env",
    metavar="VAR",
    help="Environment variable that holds the password clients must give.",
)
@click.option(
    "--state",
    type=click.Path(dir_okay=False, path_type=Path),
    help="File that keeps the tools over a restart, as the controller's flash does.",
)
@click.option(
    "--speed",
    type=click.FloatRange(min=0.01, max=1000),
    default=1.0,
    show_default=True,
    metavar="FACTOR",
    help="How many times faster than real the simulated time passes.",
)
@click.option(
    "--option",
    "options",
    multiple=True,
    metavar="NAME=VALUE",
    help="A habit of the controller; a wrong name lists them all. May be repeated.",
)
@click.option(
    "--profile",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Cell profile written by verify-controller; --option overrules it.",
)
@click.option(
    "--replay",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Serve a dialogue that --record has written, in place of a simulator.",
)
@click.option("--allow-remote", is_flag=True, help="Listen where other machines can reach it, too.")
@json_option
def epson(
    *,
    address: str,
    robot: str,
    seed: int,
    password_env: str | None,
    state: Path | None,
    speed: float,
    options: tuple[str, ...],
    profile: Path | None,
    replay: Path | None,
    allow_remote: bool,
) -> None:
    """Serve a simulated EPSON controller with Remote Ethernet until Ctrl-C.

    A second port, assist, stands in for the person at the cell: it looks at the tip, knows
    the truth, and presses the emergency stop.
    """
    from robolink_simulators.epson import EpsonSimulator

    listen = _host_and_port(address)
    if replay is not None:
        with _Termination() as stopped:
            serve_recording(replay, listen, allow_remote=allow_remote, wait=stopped.wait)
        return
    simulator = EpsonSimulator(
        robot,
        seed=seed,
        password=_password(password_env),
        options=_habits(options, profile),
        state_path=state,
    )
    _serve(simulator, listen, speed=speed, allow_remote=allow_remote)


@sim.command()
@click.argument("url")
@click.argument("act")
@click.argument("values", nargs=-1, metavar="[NAME=NUMBER]...")
@json_option
def assist(url: str, act: str, values: tuple[str, ...]) -> None:
    """Be the person at a simulated cell: press its buttons, teach its points, see its truth.

    URL is the assist URL that 'robolink sim epson' prints. Acts are for example press_estop,
    release_estop, open_guard, teach, auto, teach_point number=901 u_deg=180, truth; an unknown
    one lists them all.
    """
    from robolink_cli._assisting import do_act

    do_act(url, act, values)


def _serve(
    simulator: "EpsonSimulator", address: tuple[str, int], *, speed: float, allow_remote: bool
) -> None:
    from robolink_simulators.assist import serve_assist
    from robolink_simulators.clock import ScaledClock
    from robolink_simulators.hosting.tcp import serve_tcp

    clock = ScaledClock(speed)
    with ExitStack() as stack:
        stopped = stack.enter_context(_Termination())
        tcp = stack.enter_context(
            serve_tcp(simulator, *address, clock=clock, allow_remote=allow_remote)
        )
        assist = stack.enter_context(serve_assist(simulator, clock=clock))
        _announce(tcp.url, assist.url, simulator.machine.model.name, simulator.seed)
        stopped.wait()


class _Termination:
    """Makes SIGTERM an orderly end; Ctrl-C stays what it is."""

    def __init__(self) -> None:
        self._stopped = threading.Event()
        self._before: Any = None

    def wait(self) -> None:
        """Block until SIGTERM."""
        # In slices, because Windows delivers Ctrl-C only between waits.
        while not self._stopped.wait(0.5):
            pass

    def __enter__(self) -> "_Termination":
        self._before = signal.signal(signal.SIGTERM, lambda _number, _frame: self._stopped.set())
        return self

    def __exit__(self, *_details: object) -> None:
        signal.signal(signal.SIGTERM, self._before)


def _announce(url: str, assist_url: str, robot: str, seed: int) -> None:
    if json_is_on():
        document = {
            "schema": "robolink/sim/1",
            "url": url,
            "assist": assist_url,
            "robot": robot,
            "seed": seed,
            "simulated": True,
        }
        # One line; click flushes it, because whoever started us waits for it.
        lines = [json.dumps(document)]
    else:
        lines = [
            tr("SIMULATED EPSON {robot} (seed {seed}). No robot moves.", robot=robot, seed=seed),
            tr("  controller  {url}", url=url),
            tr("  assist      {url}", url=assist_url),
            tr("Try: robolink -c {url} status", url=url),
            tr("Ctrl-C ends it."),
        ]
    click.echo("\n".join(lines))


def _host_and_port(address: str) -> tuple[str, int]:
    host, colon, port = address.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not (colon and host and port.isascii() and port.isdigit() and int(port) <= 0xFFFF):
        raise ConfigError(
            tr("{address!r} is no address to listen on.", address=address),
            remedy=tr("Write for example --tcp 127.0.0.1:5000."),
        )
    return host, int(port)


def _password(variable: str | None) -> "Secret | None":
    if variable is None:
        return None
    import os

    from robolink.model import Secret

    value = os.environ.get(variable)
    if not value:
        raise ConfigError(
            tr("The environment variable {variable} holds no password.", variable=variable),
            remedy=tr("Set it first, or leave --password-env out."),
        )
    return Secret(value)


def _habits(options: tuple[str, ...], profile: Path | None) -> "EpsonOptions":
    from robolink_simulators.epson.option_text import options_from_text
    from robolink_simulators.epson.profile import read_profile

    pairs: dict[str, str] = {}
    for option in options:
        name, equals, value = option.partition("=")
        if not equals or name in pairs:
            raise ConfigError(
                tr("The option {option!r} is not NAME=VALUE, or stands twice.", option=option),
                remedy=tr("Write for example --option terminator=cr."),
            )
        pairs[name] = value
    settled = {} if profile is None else read_profile(profile)
    return options_from_text({**settled, **pairs})
