"""The two rows that stand above every screen."""

from collections.abc import Iterator
from enum import IntEnum
from typing import Final

from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink_cli.console.columns import columns
from robolink_cli.console.machine_words import state_word
from robolink_cli.wizard.happenings import Reading
from robolink_cli.wizard.screens.layout import WIDTH
from robolink_cli.wizard.state import WizardState


class JobStep(IntEnum):
    """The steps of a change, as they are numbered."""

    CHOOSE = 1
    CHECK = 2
    ON_THE_WAY = 3
    TOUCH = 4
    FIT = 5
    VALUES = 6
    TURN_TEST = 7


def title_row(state: WizardState, name: str, step: JobStep | None = None) -> tuple[str, str]:
    """Return the first row: cell and job at the left, the step at the right.

    Args:
        state: The state.
        name: What the screen is called.
        step: Which step it belongs to, ``None`` for none; its number is left out where the job's
            steps have none, and where it would cut off something else.
    """
    header = state.header
    left, simulated = f"{header.cell}   {header.job}", ""
    if header.simulated:
        simulated = "  " + tr("SIMULATED")
    if step is not None and header.steps:
        numbered = tr("{k} of {n}  {step}", k=min(step, header.steps), n=header.steps, step=name)
        if columns(left) + 3 + columns(numbered + simulated) <= WIDTH:
            name = numbered
    return left, f"{name}{simulated}"


def status_row(state: WizardState, now_s: float) -> str:
    """Return the second row: the state of the machine, and how old the reading is."""
    reading = state.reading
    if reading is None:
        return tr("No reading from the controller yet.")
    tool = ""
    if reading.pose is not None and reading.pose.tool is not None:
        tool = "   " + tr("tool {n} selected", n=reading.pose.tool)
    age = tr("reading {s} s", s=f"{max(0.0, now_s - reading.at_s):.1f}")
    known = "".join(f"   {word}" for word in _switched(reading))
    return f"{state_word(reading.state).upper()}{known}{tool}   {age}"


def _switched(reading: Reading) -> Iterator[str]:
    """Yield what was read of motors and power; what was not read is not said."""
    if reading.motors is not None:
        yield tr("motors on") if reading.motors else tr("motors OFF")
    if reading.low_power is not None:
        yield tr("power LOW") if reading.low_power else tr("power HIGH")


UPRIGHT: Final = ("X", "Y", "Z", "U")
_TILTED: Final = (*UPRIGHT, "V", "W")
_TILTS_DEG: Final = 0.005
"""Less than this is 0 in the two decimals that are shown."""


def coordinate_names(*shown: Pose | ToolOffset) -> tuple[str, ...]:
    """Return which coordinates a table has: V and W only where one of its rows tilts."""
    tilts = any(abs(angle) >= _TILTS_DEG for one in shown for angle in (one.v_deg, one.w_deg))
    return _TILTED if tilts else UPRIGHT


def mm(value: float) -> str:
    """Return a length with three decimals, no negative zero."""
    return f"{round(value, 3) + 0.0:.3f}"


def signed(value: float, digits: int = 3) -> str:
    """Return a difference with its sign."""
    return f"{round(value, digits) + 0.0:+.{digits}f}"
