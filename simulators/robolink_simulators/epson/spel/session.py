"""What an expression or a statement can access."""

import random
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

from robolink_simulators.epson.condition import Condition
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.memory.variables import Variables
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel.file_folder import FileFolder
from robolink_simulators.epson.spel.tree import Binary, Expression, Literal, Name

PointFile = tuple[dict[int, Point], dict[str, int]]
"""Points by number, and the point numbers of labels."""


@cache
def _at_power_on() -> Expression:
    """Return the condition of a bare Till, Find or Sense: ``Sw(0) = On``.

    Source: docs/reference/spel.md 6.3.
    """
    return Binary("=", Name("sw", (Literal(0),)), Name("on"))


@dataclass(slots=True)
class WindowMemory:
    """What statements store for the next ones; a restart clears it.

    Attributes:
        till: Condition of a bare Till.
        find: Condition of a bare Find.
        sense: Condition of a bare Sense.
        wait_limit_s: TMOut: longest Wait without a time of its own, 0 for ever.
        timed_out: TW: whether the last Wait for a condition ran out of time.
        last_error: Err: number of the last statement that failed, 0 for none.
    """

    till: Expression = field(default_factory=_at_power_on)
    find: Expression = field(default_factory=_at_power_on)
    sense: Expression = field(default_factory=_at_power_on)
    wait_limit_s: int = 0
    timed_out: bool = False
    last_error: int = 0


class UserError(NamedTuple):
    """An error that a project defines.

    Attributes:
        number: 8000 to 8999.
        text: What ErrMsg$ gives for it.
    """

    number: int
    text: str


@dataclass(slots=True)
class Session:
    """The machine, the controller's state and behaviour, and earlier settings.

    Attributes:
        machine: The robot and its memory.
        options: The controller's habits and error numbers.
        rng: The dice of RealPos.
        condition: What GetStatus shows.
        variables: The project's Global Preserve variables.
        messages: Texts of error numbers.
        memory: What earlier statements have set.
        files: The folder that file statements reach.
        point_files: The point files of the project, by their names in lower case.
        project_name: What the project is called.
        user_errors: Errors 8000 to 8999 of the project, by their labels in lower case.
    """

    machine: Machine
    options: EpsonOptions
    rng: random.Random
    condition: Condition
    variables: Variables
    messages: Mapping[int, str]
    memory: WindowMemory = field(default_factory=WindowMemory)
    files: FileFolder = field(default_factory=FileFolder)
    point_files: dict[str, PointFile] = field(default_factory=dict)
    project_name: str = ""
    user_errors: dict[str, UserError] = field(default_factory=dict)
