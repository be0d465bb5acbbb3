"""What a backup contains, taking one, and its differences from a controller's tools."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Protocol

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import (
    COMPONENTS,
    ControllerFacts,
    OutcomeLog,
    ToolOffset,
    ToolTable,
    angle_difference_deg,
)
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import wall_label
from robolink.version import VERSION

TOOLS: Final = range(1, 16)
"""The tools that a controller can define (docs/reference/epson.md 3.1); a backup names every
one."""


class ToolHolder(Protocol):
    """What backups need of a controller."""

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
        selected: The selected tool, 0 for the flange; ``None`` where the controller does not
            tell.
    """

    tools: Mapping[int, ToolOffset | None] = field(hash=False)
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
    """Read all tools and which one is selected.

    Raises:
        NotReadyError: The controller cannot be asked now, for example because a program runs.
    """
    # A machine builder's registers may hold fewer tools; the others read as undefined.
    tools = {**dict.fromkeys(TOOLS), **controller.tools.read_all()}
    return ToolState(tools, controller.tools.selected())


def take_backup(controller: ToolHolder) -> Backup:
    """Read everything that a backup contains; changes nothing.

    Raises:
        NotReadyError: As for :func:`read_tools`.
    """
    state = read_tools(controller)
    return Backup(controller.identity, wall_label(), VERSION, controller.facts(), state)


_LENGTHS = 3


@dataclass(frozen=True, slots=True)
class ComparisonTolerance:
    """The largest difference that counts as none.

    By default half the last digit that a controller prints (docs/reference/rules.md 3): values that
    it prints alike are equal.

    Raises:
        ConfigError: One is negative or no number.
    """

    length_mm: float = 0.0005
    angle_deg: float = 0.0005

    def __post_init__(self) -> None:
        if not (0 <= self.length_mm < float("inf") and 0 <= self.angle_deg < float("inf")):
            raise ConfigError(
                tr("A tolerance must be a number of 0 or more."),
                remedy=tr(
                    "For example {tolerance}.", tolerance=remedy_word(RemedyWord.LENGTH_TOLERANCE)
                ),
            )


@dataclass(frozen=True, slots=True)
class ComponentComparison:
    """One component of one tool: a length in mm or an angle in degrees.

    Attributes:
        name: Such as ``x_mm``.
        expected: What the file holds.
        found: What the controller holds.
        delta: Found less expected; an angle modulo 360, from -180 up.
        tolerance: What is allowed.
    """

    name: str
    expected: float
    found: float
    delta: float
    tolerance: float

    @property
    def equal(self) -> bool:
        """Whether the difference is allowed."""
        # Without the factor, rounding would exclude a difference equal to a bound such as 0.1.
        return abs(self.delta) <= self.tolerance * (1 + 1e-9)


@dataclass(frozen=True, slots=True)
class ToolComparison:
    """One tool.

    Attributes:
        tool: Its number.
        expected: What the file holds, ``None`` for undefined.
        found: What the controller holds.
        components: One each where both are defined, else none.
    """

    tool: int
    expected: ToolOffset | None
    found: ToolOffset | None
    components: tuple[ComponentComparison, ...] = ()

    @property
    def equal(self) -> bool:
        """Whether both are undefined, or both defined and alike."""
        if self.expected is None or self.found is None:
            return self.expected is self.found
        return all(component.equal for component in self.components)


@dataclass(frozen=True, slots=True)
class Comparison:
    """All tools, and the selected one.

    Attributes:
        tools: One each, in order.
        expected_selected: The selected tool in the file.
        found_selected: The selected tool on the controller.
        selection_counts: Whether another tool in force is a difference.
    """

    tools: tuple[ToolComparison, ...]
    expected_selected: int | None
    found_selected: int | None
    selection_counts: bool = True

    @property
    def differing(self) -> tuple[ToolComparison, ...]:
        """The tools that are not alike."""
        return tuple(tool for tool in self.tools if not tool.equal)

    @property
    def same_selection(self) -> bool:
        """Whether the same tool is selected."""
        return self.expected_selected == self.found_selected

    @property
    def equal(self) -> bool:
        """Whether there is no difference that counts."""
        return not self.differing and (self.same_selection or not self.selection_counts)


def compare(
    expected: ToolState,
    found: ToolState,
    tolerance: ComparisonTolerance | None = None,
    *,
    selection_counts: bool = True,
) -> Comparison:
    """Compare the tools in a backup with those of a controller.

    Args:
        expected: From the file.
        found: From the controller.
        tolerance: What counts as alike.
        selection_counts: Whether another tool in force is a difference. While a program runs
            it selects tools by itself.

    Example:
        >>> from dataclasses import replace
        >>> import robolink
        >>> from robolink.backup import compare, read_tools
        >>> with robolink.connect("epson+sim://compare-example") as controller:
        ...     kept = read_tools(controller)
        >>> now = replace(kept, tools={**kept.tools, 2: robolink.ToolOffset(5, 6, -70)})
        >>> [one.tool for one in compare(kept, now).differing]
        [2]
    """
    limits = tolerance or ComparisonTolerance()
    return Comparison(
        tuple(_tool(tool, expected, found, limits) for tool in TOOLS),
        expected.selected,
        found.selected,
        selection_counts,
    )


def _tool(
    tool: int, expected: ToolState, found: ToolState, limits: ComparisonTolerance
) -> ToolComparison:
    wanted, stored = expected.tools[tool], found.tools[tool]
    if wanted is None or stored is None:
        return ToolComparison(tool, wanted, stored)
    values = zip(COMPONENTS, wanted.components(), stored.components(), strict=True)
    components = tuple(
        ComponentComparison(name, a, b, b - a, limits.length_mm)
        if place < _LENGTHS
        else ComponentComparison(name, a, b, angle_difference_deg(b, a), limits.angle_deg)
        for place, (name, a, b) in enumerate(values)
    )
    return ToolComparison(tool, wanted, stored, components)
