"""Every act by name, for each kind of simulated controller."""

from collections.abc import Mapping
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.control.acts.declared import Answer, ControlAct, Given
from robolink_simulators.control.acts.epson import EPSON_ACTS
from robolink_simulators.control.acts.keeping import KEEPING_ACTS
from robolink_simulators.control.acts.plc import MAPPED_ACTS, PLC_ACTS
from robolink_simulators.control.acts.wire import WIRE_ACTS
from robolink_simulators.control.acts.world import WORLD_ACTS
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.epson.refusals import SpelRefusal
from robolink_simulators.softmotion.smc_errors import BlockRefused


class UnknownActError(ConfigError):
    """There is no act of that name at this kind of controller."""


MACHINE_REFUSALS: Final = (SpelRefusal, BlockRefused)
"""What an act ends in that the simulated robot cannot do."""


def machine_refusal(refused: Exception) -> tuple[str, str]:
    """Return what one of these says, and what to do next."""
    return str(refused), tr("Nothing was changed. Ask for what this machine can do.")


def defect(error: Exception) -> tuple[str, str]:
    """Return what is said of an act that fails as none should, and what to do next."""
    return (
        tr("The simulator failed: {cause}.", cause=f"{type(error).__name__}: {error}"),
        tr("That is a defect of the simulator: please report it."),
    )


def _by_name(*families: tuple[ControlAct, ...]) -> dict[str, ControlAct]:
    return {act.name: act for family in families for act in family}


ACTS: Final[Mapping[str, Mapping[str, ControlAct]]] = {
    "epson": _by_name(WORLD_ACTS, KEEPING_ACTS, WIRE_ACTS, EPSON_ACTS),
    "softmotion": _by_name(WORLD_ACTS, KEEPING_ACTS, WIRE_ACTS, PLC_ACTS),
    "plc": _by_name(KEEPING_ACTS, WIRE_ACTS, MAPPED_ACTS),
}
"""Kind of controller, name of the act."""


def texts_of(name: str) -> frozenset[str]:
    """Return what of an act are texts, at any kind: a shell cannot tell "007" from a number."""
    acts = [of_kind[name] for of_kind in ACTS.values() if name in of_kind]
    return frozenset(taken.name for act in acts for taken in act.takes if taken.form == "text")


def act_named(cell: ControlledCell, name: object) -> ControlAct:
    """Return an act of a cell.

    Raises:
        UnknownActError: There is none of that name.
    """
    acts = ACTS[cell.simulator.kind]
    act = acts.get(str(name))
    if act is None:
        raise UnknownActError(
            tr("The simulator cannot do {act!r}.", act=name),
            remedy=tr("These are known: {acts}.", acts=", ".join(acts)),
        )
    return act


def methods_of(cell: ControlledCell, name: str) -> tuple[str, ...]:
    """Return how an act is asked for: by GET, too, where it changes nothing.

    Raises:
        UnknownActError: No kind of controller has it.
    """
    # An act of another kind is refused by what it is, not by its method, which is the same there.
    known = [of_kind[name] for of_kind in ACTS.values() if name in of_kind]
    act = known[0] if known else act_named(cell, name)
    return ("GET", "POST") if act.reads else ("POST",)


def perform(cell: ControlledCell, name: object, given: Given) -> Answer:
    """Do what an act says, at the present time, and return what it gives.

    Args:
        cell: Where.
        name: Of the act.
        given: What it takes, by name.

    Raises:
        ConfigError: There is no such act, or a value is missing, wrong or unknown.
        SpelRefusal, BlockRefused: The simulated robot cannot do it.
    """
    act = act_named(cell, name)
    checked = act.checked(given)
    with cell.simulator.acting():
        return act.carry_out(cell, checked)
