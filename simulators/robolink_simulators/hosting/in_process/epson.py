"""``epson+sim://NAME``: simulators that live in this process and are shared by name."""

import random
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.timing import Clock
from robolink.transport import LinkUrl
from robolink_simulators.cell.world_parameters import from_options, plain
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import option_names, options_from_text
from robolink_simulators.faults import LinkKind, read_fault_file
from robolink_simulators.hosting.in_process.named import (
    NamedSimulators,
    answer_ms_from_text,
    seed_from_text,
)
from robolink_simulators.hosting.in_process.transport import InProcessTransport
from robolink_simulators.option_values import require_known
from robolink_simulators.state_files import drawn_serial

__all__ = ["register", "unregister"]

_OWN_OPTIONS: Final = ("robot", "seed", "state", "split", "faults", "answer_ms")

_named: Final = NamedSimulators[EpsonSimulator]("epson+sim")


def open_epson(
    link_url: LinkUrl,
    *,
    timeout_s: float = 3.0,  # noqa: ARG001 - there is nothing to wait for
    clock: Clock | None = None,
) -> InProcessTransport:
    """Connect to the simulator of that name; it is made when there is none yet.

    Args:
        link_url: ``epson+sim://NAME``, with ``robot``, ``seed``, ``state`` (a file that keeps
            the tools), ``faults`` (a fault plan, docs/fault-plans.md), ``answer_ms`` (when an
            answer leaves), ``split`` (1 cuts what arrives into random pieces), ``world.NAME``
            (see ``WorldParameters``) and any field of ``EpsonOptions`` as options.
        timeout_s: Not needed; part of the contract of an opener.
        clock: A :class:`~robolink_simulators.cell.clock.ManualClock` becomes the clock of a new
            simulator. Any other clock is left aside: simulated time is the simulator's own.

    Raises:
        ConfigError: An option is unknown, does not fit, or contradicts how the simulator of
            that name was made.
    """
    options = dict(link_url.options)
    split = options.pop("split", "0")
    if split not in ("0", "1"):
        raise ConfigError(
            tr("The option {name} cannot be {value!r}.", name="split", value=split),
            remedy=tr("Give 1 to cut what arrives into pieces, or leave it out."),
        )
    named = _named.open(link_url, options, clock, lambda given: _made(link_url.host, given))
    simulator = named.simulator
    return InProcessTransport(
        link_url,
        simulator,
        named.clock,
        simulator.lock,
        durable=simulator.durable,
        splitter=random.Random(f"split {simulator.seed}") if split == "1" else None,
    )


simulator_named = _named.simulator
register = _named.register
unregister = _named.unregister
clock_of = _named.clock


def _made(name: str, options: Mapping[str, str]) -> EpsonSimulator:
    known = {key: options[key] for key in _OWN_OPTIONS if key in options}
    habits = {key: value for key, value in plain(options).items() if key not in _OWN_OPTIONS}
    require_known(habits, (*_OWN_OPTIONS, *option_names()), kind="EPSON")
    state = known.get("state")
    seed = seed_from_text(known.get("seed", "1"))
    simulator = EpsonSimulator(
        known.get("robot", "T6-602S"),
        seed=seed,
        serial=drawn_serial(f"{name.lower()} {seed}"),
        options=options_from_text(habits),
        state_path=Path(state) if state else None,
        world=from_options(options),
        answer_ms=answer_ms_from_text(known.get("answer_ms", "0")),
    )
    if "faults" in known:
        file = read_fault_file(Path(known["faults"]))
        simulator.faults.plan(file.faults, file.seed, {LinkKind.EPSON_SIM})
    return simulator
