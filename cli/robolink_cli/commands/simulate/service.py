"""What every served simulator needs: an address, options, and an orderly end."""

import json
import os
import select
import signal
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Secret
from robolink_cli.console.output import hand_over, show
from robolink_cli.console.render import json_is_on, note
from robolink_cli.options.simulation import ServedLife

if TYPE_CHECKING:
    from robolink_simulators.cell.world_parameters import WorldParameters
    from robolink_simulators.control.cell import ControlledCell
    from robolink_simulators.control.server import ControlServer

    from robolink.errors import RobolinkError


class ParentWatch:
    """Reports when the process has ended that a simulator must not outlive.

    Args:
        number: Its process id; ``None`` for the process that started this one.
    """

    def __init__(self, number: int | None = None) -> None:
        self._number = number
        self._starter = os.getppid()
        self._handle: int | None = None
        self._gone = False
        if number is not None:
            # A handle reports the end even before anybody has waited for it, and is not misled by
            # another process with the same number. Some systems have no such handles.
            try:
                self._handle = os.pidfd_open(number)
            except ProcessLookupError:
                self._gone = True
            except (AttributeError, OSError):
                self._handle = None

    def ended(self) -> bool:
        """Whether it has."""
        if self._number is None:
            return os.getppid() != self._starter
        if self._handle is not None:
            looked_at = select.poll()  # works even if the process has thousands of handles
            looked_at.register(self._handle, select.POLLIN)
            self._gone = bool(looked_at.poll(0))
        elif not self._gone:
            try:
                os.kill(self._number, 0)
            except ProcessLookupError:
                self._gone = True
            except PermissionError:
                return False  # it is running, under another user
        return self._gone

    def close(self) -> None:
        """Stop checking."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None


class Termination:
    """Makes SIGTERM an orderly end; Ctrl-C is unchanged.

    What a simulator fails of that can keep its state no longer is told once, by whoever waits: the
    thread that served it tells nothing.

    Args:
        life: When it ends by itself; never where that is left out. Whose end it waits for is the
            process that started this one, or the one that ``life`` names.

    Attributes:
        state_dir: A folder for what clients of this simulator keep on record, gone at its end.

    Raises:
        ConfigError: This system does not tell a process that its parent has ended.
    """

    def __init__(self, life: ServedLife | None = None) -> None:
        self._life = life
        if life is not None and life.with_parent and os.name == "nt":
            raise ConfigError(
                tr("On Windows a simulator cannot detect that its parent process has ended."),
                remedy=tr("Use --idle-exit there."),
            )
        self._parent = ParentWatch(life.parent) if life and life.with_parent else None
        self._stopped = threading.Event()
        self._before: Any = None
        self._tell_before = threading.excepthook
        self._folder = TemporaryDirectory(prefix="robolink-sim-", ignore_cleanup_errors=True)
        self.state_dir = self._folder.name

    def wait(
        self,
        requests: Callable[[], int] = int,
        failure: "Callable[[], RobolinkError | None]" = lambda: None,
    ) -> None:
        """Block until SIGTERM, or until life ends otherwise.

        Args:
            requests: Tells how many requests there were so far.
            failure: Tells why what is served can go on no longer.

        Raises:
            RobolinkError: That is so.
        """
        seen, since_s = -1, monotonic()
        # In slices, because Windows delivers Ctrl-C only between waits.
        while not self._stopped.wait(self._slice_s()):
            if (failed := failure()) is not None:
                raise failed
            if (now := requests()) != seen:
                seen, since_s = now, monotonic()
            if self._is_over(monotonic() - since_s):
                return

    def _slice_s(self) -> float:
        idle_s = self._life and self._life.idle_exit_s
        return min(0.5, idle_s / 4) if idle_s else 0.5

    def _is_over(self, idle_s: float) -> bool:
        if self._life is None:
            return False
        if self._parent is not None and self._parent.ended():
            return True
        return self._life.idle_exit_s is not None and idle_s >= self._life.idle_exit_s

    @property
    def came(self) -> bool:
        """Whether it came."""
        return self._stopped.is_set()

    def __enter__(self) -> "Termination":
        self._before = signal.signal(signal.SIGTERM, lambda _number, _frame: self._stopped.set())
        self._tell_before, threading.excepthook = threading.excepthook, self._tell
        return self

    def __exit__(self, *_details: object) -> None:
        threading.excepthook = self._tell_before
        signal.signal(signal.SIGTERM, self._before)
        if self._parent is not None:
            self._parent.close()
        self._folder.cleanup()

    def _tell(self, failed: threading.ExceptHookArgs) -> None:
        """Report what ended a thread, unless the waiting one reports it."""
        from robolink_simulators.state_files import StateNotKeptError

        if not isinstance(failed.exc_value, StateNotKeptError):
            self._tell_before(failed)


def announce(
    document: dict[str, object],
    lines: Sequence[str],
    state_dir: str,
    *,
    schema: str = "robolink/sim/1",
) -> None:
    """Print the first output: one line of JSON, or ``lines`` for a person.

    Scripts give ``state_dir`` to their clients as ROBOLINK_STATE_DIR, so that nothing of a run is
    left in a journal of somebody's own.

    click flushes it, because whoever started us waits for it.
    """
    if json_is_on():
        document = {
            "schema": schema,
            **document,
            "state_dir": state_dir,
            "pid": os.getpid(),
            "simulated": True,
        }
        hand_over(json.dumps(document))
    else:
        show("\n".join(lines))


def controlled(
    cells: Mapping[str, "ControlledCell"], life: ServedLife, *, allow_remote: bool
) -> "ControlServer":
    """Serve the control API of simulators.

    Raises:
        ConfigError: Its address is none, or other machines could reach it and may not.
        ConnectError: The port is taken.
    """
    from robolink_simulators.control.server import ControlServer

    address = host_and_port(life.control, "--control")
    return ControlServer(cells, address, allow_remote=allow_remote)


def host_and_port(address: str, option: str) -> tuple[str, int]:
    """Return host and port of an address; a port alone is one of this computer.

    Raises:
        ConfigError: It is none; names the option that it was given to.
    """
    host, colon, port = address.rpartition(":")
    host = host.removeprefix("[").removesuffix("]") if colon else "127.0.0.1"
    if not (host and port.isascii() and port.isdigit() and len(port) <= 5 and int(port) <= 0xFFFF):
        raise ConfigError(
            tr("{address!r} is not an address to listen on.", address=address),
            remedy=tr("Write for example {option} 127.0.0.1:5000.", option=option),
        )
    return host, int(port)


def password_in(variable: str | None, option: str) -> Secret | None:
    """Return the password in an environment variable, ``None`` when none is named.

    Args:
        variable: Its name.
        option: The option that names it.

    Raises:
        ConfigError: The variable holds none.
    """
    if variable is None:
        return None
    value = os.environ.get(variable)
    if not value:
        raise ConfigError(
            tr("The environment variable {variable} holds no password.", variable=variable),
            remedy=tr("Set it first, or leave {option} out.", option=option),
        )
    return Secret(value)


def opcua_users(name: str | None, variable: str | None) -> dict[str, Secret]:
    """Return the password of the one user whom an OPC UA server lets in; empty for anybody.

    Raises:
        ConfigError: A name without a password, or the other way round.
    """
    password = password_in(variable, "--opcua-password-env")
    if (name is None) is not (password is None):
        raise ConfigError(
            tr("A user of the OPC UA server needs a name and a password."),
            remedy=tr("Give both --opcua-user and --opcua-password-env, or neither."),
        )
    return {} if name is None or password is None else {name: password}


def named_values(texts: Sequence[str], example: str) -> dict[str, str]:
    """Return what was given as NAME=VALUE, each name once.

    Raises:
        ConfigError: Something is not, or stands twice.
    """
    pairs: dict[str, str] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or name in pairs:
            raise ConfigError(
                tr("The option {option!r} is not NAME=VALUE, or is given twice.", option=text),
                remedy=tr("Write for example {example}.", example=example),
            )
        pairs[name] = value
    return pairs


def world_from(texts: Sequence[str]) -> "WorldParameters":
    """Return the world that ``--world`` describes.

    Raises:
        ConfigError: It is not NAME=VALUE, or there is no such parameter.
    """
    from robolink_simulators.cell.world_parameters import WorldParameters, parameters_from_text

    pairs = named_values(texts, "--world camera_noise_px=0.3")
    return replace(WorldParameters(), **parameters_from_text(pairs))  # type: ignore[arg-type]


_OF_A_REPLAY = frozenset({"address", "replay", "allow_remote"})


def serve_recording(
    recording: Path, address: tuple[str, int], *, allow_remote: bool, wait: Callable[[], None]
) -> None:
    """Serve a recording until ``wait`` returns; what a client does otherwise is noted.

    Raises:
        ConfigError: The file is no recording, or an option was given that says how a
            simulator behaves: a recording behaves as recorded.
    """
    from robolink_simulators.hosting.replay import ReplayDevice, read_recording, serve_replay

    _refuse_habits()
    dialogues = read_recording(recording)
    device = ReplayDevice(dialogues, on_difference=note)
    with serve_replay(device, *address, allow_remote=allow_remote) as host:
        _announce(host.url, recording, len(dialogues))
        wait()


def _refuse_habits() -> None:
    context = click.get_current_context()
    for parameter in context.command.params:
        name = str(parameter.name)
        given = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if given and parameter.expose_value and name not in _OF_A_REPLAY:
            raise ConfigError(
                tr("{option} cannot be combined with --replay.", option=parameter.opts[0]),
                remedy=tr("A replay gives only recorded answers."),
            )


def _announce(url: str, recording: Path, connections: int) -> None:
    if json_is_on():
        document = {
            "schema": "robolink/sim/1",
            "url": url,
            "replay": str(recording),
            "connections": connections,
            "simulated": True,
        }
        hand_over(json.dumps(document))
        return
    lines = (
        tr(
            "REPLAY of {path} ({count} connections). No robot moves.",
            path=recording,
            count=connections,
        ),
        tr("  controller  {url}", url=url),
        tr("Ctrl-C ends it."),
    )
    show("\n".join(lines))
