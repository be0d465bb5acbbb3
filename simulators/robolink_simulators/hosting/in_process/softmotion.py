"""``softmotion+sim://NAME``: simulated PLCs that live in this process and are shared by name."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from robolink.timing import Clock
from robolink.transport import LinkUrl
from robolink_simulators.cell.world_parameters import from_options, plain
from robolink_simulators.faults import LinkKind, read_fault_file
from robolink_simulators.hosting.in_process.mailbox_link import InProcessMailboxLink
from robolink_simulators.hosting.in_process.named import (
    NamedSimulators,
    answer_ms_from_text,
    seed_from_text,
)
from robolink_simulators.option_values import require_known
from robolink_simulators.softmotion.catalogue import parameter_names
from robolink_simulators.softmotion.mailbox.option_text import (
    option_names,
    options_from_text,
    parameters_from_text,
)
from robolink_simulators.softmotion.mailbox.simulator import (
    DEFAULT_KINEMATICS,
    SoftMotionSimulator,
)

__all__ = ["register", "unregister"]

_OWN_OPTIONS: Final = ("kinematics", "seed", "state", "faults", "answer_ms")

_named: Final = NamedSimulators[SoftMotionSimulator]("softmotion+sim")


def open_softmotion(
    link_url: LinkUrl, *, timeout_s: float = 3.0, clock: Clock | None = None
) -> InProcessMailboxLink:
    """Connect to the simulated PLC of that name; it is made when there is none yet.

    Args:
        link_url: ``softmotion+sim://NAME``, with ``kinematics`` (``+Kin_CAxis`` is written
            ``%2BKin_CAxis``), ``seed``, ``state`` (a file that keeps what is retained),
            ``faults`` (a fault plan, docs/fault-plans.md), ``answer_ms`` (when an answer
            leaves), any parameter of the kinematics, ``world.NAME`` (see ``WorldParameters``),
            and any field of ``GroupOptions`` and ``MailboxOptions`` as options.
        timeout_s: Longest wait for an answer, in simulated time.
        clock: A :class:`~robolink_simulators.cell.clock.ManualClock` becomes the clock of a new
            simulator. Any other clock is left aside: simulated time is the simulator's own.

    Raises:
        ConfigError: An option is unknown, does not fit, or contradicts how the simulator of
            that name was made.
    """
    named = _named.open(link_url, link_url.options, clock, _made)
    return InProcessMailboxLink(link_url.identity, named.simulator, named.clock, timeout_s)


simulator_named = _named.simulator
register = _named.register
unregister = _named.unregister
clock_of = _named.clock


def _made(options: Mapping[str, str]) -> SoftMotionSimulator:
    # An unescaped plus sign has become a space.
    kinematics = options.get("kinematics", DEFAULT_KINEMATICS).replace(" ", "+")
    of_machine = parameter_names(kinematics)
    names = (*_OWN_OPTIONS, *of_machine, *option_names())
    require_known(plain(options), names, kind="PLC")
    state = options.get("state")
    habits = {name: value for name, value in options.items() if name in option_names()}
    parameters = {name: value for name, value in options.items() if name in of_machine}
    simulator = SoftMotionSimulator(
        kinematics,
        seed=seed_from_text(options.get("seed", "1")),
        parameters=parameters_from_text(parameters),
        options=options_from_text(habits),
        state_path=Path(state) if state else None,
        world=from_options(options),
        answer_ms=answer_ms_from_text(options.get("answer_ms", "0")),
    )
    if "faults" in options:
        file = read_fault_file(Path(options["faults"]))
        simulator.faults.plan(file.faults, file.seed, {LinkKind.MAILBOX_SIM})
    return simulator
