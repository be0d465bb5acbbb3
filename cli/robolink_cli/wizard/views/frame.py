"""What every view shares: the first row, the controller, and how numbers are written."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from robolink.model import Pose, ToolOffset
from robolink_cli.console.shell_words import state_word
from robolink_cli.wizard.happenings import Reading
from robolink_cli.wizard.state import WizardState
from robolink_cli.wizard.views.records import Action, Body, Head, Status, Weight


class JobStep(IntEnum):
    """The steps of a change, as they are numbered."""

    CHOOSE = 1
    CHECK = 2
    ON_THE_WAY = 3
    TOUCH = 4
    FIT = 5
    VALUES = 6
    TURN_TEST = 7


@dataclass(frozen=True, slots=True)
class Part:
    """What one kind of screen adds to the frame.

    Attributes:
        title: What the screen is called.
        body: What it shows.
        actions: What can be pressed there.
        step: Which step of a change it belongs to; ``None`` for none.
    """

    title: str
    body: Body
    actions: tuple[Action, ...]
    step: JobStep | None = None


def leaves(label: str, key: str = "0") -> Action:
    """Return the action that ends the job."""
    return Action("leave", label, key=key, weight=Weight.LEAVES)


def head_of(state: WizardState, title: str, step: JobStep | None = None) -> Head:
    """Return the first row.

    Args:
        state: The state.
        title: What the screen is called.
        step: Which step it belongs to; it is left out where those of the job have no numbers.
    """
    header = state.header
    numbered = None
    if step is not None and header.steps:
        numbered = (min(step, header.steps), header.steps)
    return Head(header.cell, header.job, title, numbered, header.simulated, header.needle)


def status_of(reading: Reading | None, now_s: float) -> Status | None:
    """Return the controller as it was read last; ``None`` before that."""
    if reading is None:
        return None
    return Status(
        state_word(reading.state),
        reading.halted,
        max(0.0, now_s - reading.at_s),
        reading.motors,
        reading.low_power,
        None if reading.pose is None else reading.pose.tool,
    )


UPRIGHT: Final = ("X", "Y", "Z", "U")
_TILTED: Final = (*UPRIGHT, "V", "W")
_TILTS_DEG: Final = 0.005
"""Smallest angle in degrees that is not 0 in the two decimals shown."""


def coordinate_names(*shown: Pose | ToolOffset) -> tuple[str, ...]:
    """Return the coordinates of a table: V and W only if one of its rows tilts."""
    tilts = any(abs(angle) >= _TILTS_DEG for one in shown for angle in (one.v_deg, one.w_deg))
    return _TILTED if tilts else UPRIGHT


def mm(value: float) -> str:
    """Return a length with three decimals, no negative zero."""
    return f"{round(value, 3) + 0.0:.3f}"


def signed(value: float, digits: int = 3) -> str:
    """Return a difference with its sign."""
    return f"{round(value, digits) + 0.0:+.{digits}f}"
