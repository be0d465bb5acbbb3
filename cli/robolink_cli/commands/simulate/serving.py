"""What every served simulator needs: an address, options, and an orderly end."""

import json
import signal
import threading
from collections.abc import Sequence
from dataclasses import replace
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.console.output import hand_over, show
from robolink_cli.console.render import json_is_on

if TYPE_CHECKING:
    from robolink_simulators.cell.world_parameters import WorldParameters


class Termination:
    """Makes SIGTERM an orderly end; Ctrl-C stays what it is.

    Attributes:
        state_dir: A folder for what clients of this simulator keep on record, gone at its end.
    """

    def __init__(self) -> None:
        self._stopped = threading.Event()
        self._before: Any = None
        self._folder = TemporaryDirectory(prefix="robolink-sim-", ignore_cleanup_errors=True)
        self.state_dir = self._folder.name

    def wait(self) -> None:
        """Block until SIGTERM."""
        # In slices, because Windows delivers Ctrl-C only between waits.
        while not self._stopped.wait(0.5):
            pass

    @property
    def came(self) -> bool:
        """Whether it came."""
        return self._stopped.is_set()

    def __enter__(self) -> "Termination":
        self._before = signal.signal(signal.SIGTERM, lambda _number, _frame: self._stopped.set())
        return self

    def __exit__(self, *_details: object) -> None:
        signal.signal(signal.SIGTERM, self._before)
        self._folder.cleanup()


def announce(document: dict[str, object], lines: Sequence[str], state_dir: str) -> None:
    """Print the first output: one line of JSON, or ``lines`` for a person.

    Scripts give ``state_dir`` to their clients as ROBOLINK_STATE_DIR, so that nothing of a run is
    left in a journal of somebody's own.

    click flushes it, because whoever started us waits for it.
    """
    if json_is_on():
        document = {
            "schema": "robolink/sim/1",
            **document,
            "state_dir": state_dir,
            "simulated": True,
        }
        hand_over(json.dumps(document))
    else:
        show("\n".join(lines))


def host_and_port(address: str, option: str) -> tuple[str, int]:
    """Return host and port of an address.

    Raises:
        ConfigError: It is none; names the option that it was given to.
    """
    host, colon, port = address.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not (
        colon
        and host
        and port.isascii()
        and port.isdigit()
        and len(port) <= 5
        and int(port) <= 0xFFFF
    ):
        raise ConfigError(
            tr("{address!r} is no address to listen on.", address=address),
            remedy=tr("Write for example {option} 127.0.0.1:5000.", option=option),
        )
    return host, int(port)


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
                tr("The option {option!r} is not NAME=VALUE, or stands twice.", option=text),
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
