"""``epson+sim://NAME``: simulators that live in this process and are shared by name."""

import random
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.timing import Clock
from robolink.transport import LinkUrl
from robolink_simulators.clock import ManualClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.option_text import option_names, options_from_text
from robolink_simulators.hosting._transport import InProcessTransport

_OWN_OPTIONS: Final = ("robot", "seed", "state", "split")


@dataclass(frozen=True, slots=True)
class _Hosted:
    simulator: EpsonSimulator
    clock: ManualClock
    made_with: Mapping[str, str]


_hosted: Final[dict[str, _Hosted]] = {}
_registry: Final = threading.Lock()


def open_epson(
    link_url: LinkUrl,
    *,
    timeout_s: float = 3.0,  # noqa: ARG001 - there is nothing to wait for
    clock: Clock | None = None,
) -> InProcessTransport:
    """Connect to the simulator of that name; it is made when there is none yet.

    Args:
        link_url: ``epson+sim://NAME``, with ``robot``, ``seed``, ``state`` (a file that keeps
            the tools), ``split`` (1 cuts what arrives into random pieces) and any field of
            ``EpsonOptions`` as options.
        timeout_s: Not needed; part of the contract of an opener.
        clock: A :class:`ManualClock` becomes the clock of a new simulator. Any other clock
            is left aside: simulated time is the simulator's own.

    Raises:
        ConfigError: An option is unknown, does not fit, or contradicts how the simulator of
            that name was made.
    """
    options = dict(link_url.options)
    split = options.pop("split", "0")
    if split not in ("0", "1"):
        raise ConfigError(
            tr("The option split cannot be {value!r}.", value=split),
            remedy=tr("Give 1 to cut what arrives into pieces, or leave it out."),
        )
    name = _checked_name(link_url)
    with _registry:
        hosted = _hosted.get(name)
        if hosted is None:
            hosted = _hosted[name] = _made(name, options, clock)
        elif options and options != hosted.made_with:
            raise ConfigError(
                tr("The simulator {name!r} already runs with other options.", name=name),
                remedy=tr("Leave the options out, or use another name."),
            )
    simulator = hosted.simulator
    return InProcessTransport(
        link_url,
        simulator,
        hosted.clock,
        simulator.lock,
        durable=simulator.durable,
        splitter=random.Random(f"split {simulator.seed}") if split == "1" else None,
    )


def simulator_named(name: str) -> EpsonSimulator:
    """Return the simulator behind ``epson+sim://NAME``.

    Raises:
        ConfigError: Nothing was opened or registered under that name.
    """
    with _registry:
        hosted = _hosted.get(name.lower())
    if hosted is None:
        raise ConfigError(
            tr("No simulator is called {name!r}.", name=name),
            remedy=tr("Open epson+sim://{name} or register one first.", name=name),
        )
    return hosted.simulator


def register(name: str, simulator: EpsonSimulator, *, clock: ManualClock | None = None) -> str:
    """Serve a simulator under ``epson+sim://NAME`` and return that URL.

    Raises:
        ConfigError: The name is taken.
    """
    name = name.lower()
    clock = clock or ManualClock(simulator.now_ns)
    with _registry:
        if name in _hosted:
            raise ConfigError(
                tr("The name {name!r} is taken by another simulator.", name=name),
                remedy=tr("Use another name, or unregister that one."),
            )
        _hosted[name] = _host(name, simulator, clock, {})
    return simulator.url


def unregister(name: str) -> None:
    """Forget a simulator; open connections go on. An unknown name is fine."""
    with _registry:
        _hosted.pop(name.lower(), None)


def clock_of(name: str) -> ManualClock:
    """Return the clock of the simulator of that name.

    Raises:
        ConfigError: There is none.
    """
    simulator_named(name)
    return _hosted[name.lower()].clock


def _checked_name(link_url: LinkUrl) -> str:
    if not link_url.host or link_url.port is not None or link_url.path not in ("", "/"):
        raise ConfigError(
            tr("{identity} does not name a simulator.", identity=link_url.identity),
            remedy=tr("Write for example epson+sim://cell-a?seed=1."),
        )
    return link_url.host.lower()


def _made(name: str, options: Mapping[str, str], clock: Clock | None) -> _Hosted:
    known = {key: options[key] for key in _OWN_OPTIONS if key in options}
    habits = {key: value for key, value in options.items() if key not in _OWN_OPTIONS}
    unknown = sorted(set(habits) - set(option_names()))
    if unknown:
        raise ConfigError(
            tr("The EPSON simulator has no option {name!r}.", name=unknown[0]),
            remedy=tr("Known are: {names}.", names=", ".join((*_OWN_OPTIONS, *option_names()))),
        )
    state = known.get("state")
    simulator = EpsonSimulator(
        known.get("robot", "T6-602S"),
        seed=_seed(known.get("seed", "1")),
        options=options_from_text(habits),
        state_path=Path(state) if state else None,
    )
    own_clock = clock if isinstance(clock, ManualClock) else ManualClock()
    return _host(name, simulator, own_clock, options)


def _host(
    name: str, simulator: EpsonSimulator, clock: ManualClock, made_with: Mapping[str, str]
) -> _Hosted:
    simulator.url = f"epson+sim://{name}"
    simulator.present_ns = clock.now_ns
    return _Hosted(simulator, clock, dict(made_with))


def _seed(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise ConfigError(
            tr("The seed {text!r} is not a whole number.", text=text),
            remedy=tr("Give for example seed=1."),
        )
    return int(text)
