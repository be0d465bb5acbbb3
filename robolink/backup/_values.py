"""What a backup holds, and taking one."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Protocol

from robolink.model import ControllerFacts, OutcomeLog, ToolOffset, ToolTable
from robolink.timing import wall_label
from robolink.version import VERSION

TOOLS: Final = range(1, 16)
"""The tools that a controller can define (docs/reference/epson.md 3.1); a backup names every
one."""

COMPONENTS: Final = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")
"""The components of an offset, as files and documents name them."""


class ToolHolder(Protocol):
    """The side of a controller that backups need."""

    @property
    def identity(self) -> str:
        """Which controller, without options or passwords."""

    @property
    def tools(self) -> ToolTable:
        """The tool offsets."""

    @property
    def outcomes(self) -> OutcomeLog:
        """Where its markers are kept."""

    def facts(self) -> ControllerFacts:
        """Read which controller and robots these are."""


@dataclass(frozen=True, slots=True)
class ToolState:
    """All tools at one moment.

    Attributes:
        tools: Every tool by number; an undefined one is ``None``.
        selected: The tool in force, 0 for the flange; ``None`` where the controller does not
            tell.
    """

    tools: Mapping[int, ToolOffset | None]
    selected: int | None


@dataclass(frozen=True, slots=True)
class Backup:
    """The tools of one controller, and which controller that was.

    Attributes:
        controller: Its URL without options.
        saved_at: Wall-clock label, ISO 8601 UTC.
        robolink_version: Who wrote it.
        facts: Model, serial numbers, firmware, as far as they could be read.
        state: The tools.
    """

    controller: str
    saved_at: str
    robolink_version: str
    facts: ControllerFacts
    state: ToolState


def read_tools(controller: ToolHolder) -> ToolState:
    """Read all tools and which one is in force.

    Raises:
        NotReadyError: The controller cannot be asked now, for example because a program runs.
    """
    # A machine builder's own registers may hold fewer tools; the others are not there.
    tools = {**dict.fromkeys(TOOLS), **controller.tools.read_all()}
    return ToolState(tools, controller.tools.selected())


def take_backup(controller: ToolHolder) -> Backup:
    """Read everything that a backup holds; changes nothing.

    Raises:
        NotReadyError: As for :func:`read_tools`.
    """
    state = read_tools(controller)
    return Backup(controller.identity, wall_label(), VERSION, controller.facts(), state)
