"""Simulators that live in this process and are shared by name."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.timing import Clock
from robolink.transport import LinkUrl
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.device.hosted import HostedDevice

Simulator = TypeVar("Simulator", bound=HostedDevice)


@dataclass(frozen=True, slots=True)
class Named(Generic[Simulator]):
    """A simulator under its name, with its clock and the options that it was made with."""

    simulator: Simulator
    clock: ManualClock
    made_with: Mapping[str, str]


class NamedSimulators(Generic[Simulator]):
    """The simulators of one scheme, by name; case does not count.

    Args:
        scheme: Of their URLs.
    """

    def __init__(self, scheme: str) -> None:
        self._scheme = scheme
        self._named: dict[str, Named[Simulator]] = {}
        self._lock = threading.Lock()

    def open(
        self,
        link_url: LinkUrl,
        options: Mapping[str, str],
        clock: Clock | None,
        make: Callable[[Mapping[str, str]], Simulator],
    ) -> Named[Simulator]:
        """Return the simulator that a URL names; it is made when there is none yet.

        Raises:
            ConfigError: The URL names none, or contradicts how that one was made.
        """
        name = self._name_in(link_url)
        with self._lock:
            named = self._named.get(name)
            if named is None:
                own_clock = clock if isinstance(clock, ManualClock) else ManualClock()
                named = self._host(name, make(options), own_clock, options)
            elif options and options != named.made_with:
                raise ConfigError(
                    tr("The simulator {name!r} already runs with other options.", name=name),
                    remedy=tr("Leave the options out, or use another name."),
                )
            return named

    def simulator(self, name: str) -> Simulator:
        """Return the simulator of that name.

        Raises:
            ConfigError: Nothing was opened or registered under it.
        """
        return self._find(name).simulator

    def clock(self, name: str) -> ManualClock:
        """Return the clock of the simulator of that name.

        Raises:
            ConfigError: Nothing was opened or registered under it.
        """
        return self._find(name).clock

    def _find(self, name: str) -> Named[Simulator]:
        with self._lock:
            named = self._named.get(name.lower())
        if named is None:
            raise ConfigError(
                tr("No simulator is called {name!r}.", name=name),
                remedy=tr(
                    "Open {scheme}://{name} or register one first.", scheme=self._scheme, name=name
                ),
            )
        return named

    def register(self, name: str, simulator: Simulator, *, clock: ManualClock | None = None) -> str:
        """Serve a simulator under a name and return its URL, such as ``epson+sim://NAME``.

        Raises:
            ConfigError: The name is taken.
        """
        name = name.lower()
        with self._lock:
            if name in self._named:
                raise ConfigError(
                    tr("The name {name!r} is taken by another simulator.", name=name),
                    remedy=tr("Use another name, or unregister that one."),
                )
            self._host(name, simulator, clock or ManualClock(simulator.now_ns), {})
        return simulator.url

    def unregister(self, name: str) -> None:
        """Forget a simulator; open connections go on. An unknown name is fine."""
        with self._lock:
            self._named.pop(name.lower(), None)

    def _host(
        self, name: str, simulator: Simulator, clock: ManualClock, made_with: Mapping[str, str]
    ) -> Named[Simulator]:
        simulator.url = f"{self._scheme}://{name}"
        simulator.keep_time(clock)
        self._named[name] = Named(simulator, clock, dict(made_with))
        return self._named[name]

    def _name_in(self, link_url: LinkUrl) -> str:
        if not link_url.host or link_url.port is not None or link_url.path not in ("", "/"):
            raise ConfigError(
                tr("{identity} does not name a simulator.", identity=link_url.identity),
                remedy=tr("Write for example {scheme}://cell-a?seed=1.", scheme=self._scheme),
            )
        return link_url.host.lower()


def seed_from_text(text: str) -> int:
    """Return a seed.

    Raises:
        ConfigError: It is no whole number.
    """
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise ConfigError(
            tr("The seed {text!r} is not a whole number.", text=text),
            remedy=tr("Give for example seed=1."),
        )
    return int(text)


def answer_ms_from_text(text: str) -> float:
    """Return an answer time in milliseconds.

    Raises:
        ConfigError: It is no number.
    """
    try:
        return float(text)
    except ValueError as error:
        raise ConfigError(
            tr("The option {name} cannot be {value!r}.", name="answer_ms", value=text),
            remedy=tr("Give for example answer_ms=20."),
        ) from error
