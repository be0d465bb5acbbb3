"""Tool offsets and the table that holds them: the centre of the product."""

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final, Literal, Protocol, runtime_checkable

from robolink.errors import ConfigError, ToolChangedError, UnclearAnswerError
from robolink.messages import tr
from robolink.model._geometry import angle_difference_deg, described

_LEAST: Final = 1e-100
_MOST: Final = 1e9
"""Larger than any tool value in any unit, rounding included. A round number whose words are in the
wrong order is far below :data:`_LEAST`; of other numbers, one in six falls between the two."""

_LOOKS: Final = 3
"""Largest number of readings: a line that garbles three answers in a row is not fit for changing a
tool."""

_NUMBERS: Final = frozenset({float, int})

COMPONENTS: Final = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")
"""Components of an offset and of a pose, as named in files and documents."""


@dataclass(frozen=True, slots=True)
class ToolOffset:
    """Where the tip is, seen from the flange (Tool 0).

    Lengths in mm, angles in degrees, ``R = Rz(U) Ry(V) Rx(W)`` as EPSON defines it. Numbers of
    other libraries, such as numpy's, become floats.

    Raises:
        ConfigError: A component is not a finite number.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    z_mm: float = 0.0
    u_deg: float = 0.0
    v_deg: float = 0.0
    w_deg: float = 0.0

    def __post_init__(self) -> None:
        values = self.components()
        if _NUMBERS.issuperset(map(type, values)) and all(map(math.isfinite, values)):
            return  # the usual case; other types of numbers are checked one by one
        from robolink.model._arguments import not_a_number, required_number

        for name, value in zip(COMPONENTS, values, strict=True):
            if not math.isfinite(required_number(self, name)):
                raise not_a_number(name, value)

    def components(self) -> tuple[float, float, float, float, float, float]:
        """Return x, y, z in mm and u, v, w in degrees."""
        return (self.x_mm, self.y_mm, self.z_mm, self.u_deg, self.v_deg, self.w_deg)

    @property
    def of_no_tool(self) -> bool:
        """Whether one of its numbers is one that no tool has, as words in the wrong order give."""
        return of_no_tool(self.components())

    def rounded(self, decimals: int) -> "ToolOffset":
        """Return the value that a controller printing ``decimals`` places can hold."""
        return ToolOffset(*[round(value, decimals) + 0.0 for value in self.components()])

    def matches(self, other: "ToolOffset", tolerance: float) -> bool:
        """Return whether every component agrees within ``tolerance`` (mm, degrees).

        Angles are compared modulo 360: a controller may store 270 as -90.
        """
        require_offset("other", other)
        ours, theirs = self.components(), other.components()
        if ours == theirs:
            return True
        lengths = zip(ours[:3], theirs[:3], strict=True)
        angles = zip(ours[3:], theirs[3:], strict=True)
        slack = tolerance * (1 + 1e-9)
        return all(abs(a - b) <= slack for a, b in lengths) and all(
            abs(angle_difference_deg(a, b)) <= slack for a, b in angles
        )


def require_offset(name: str, offset: object) -> None:
    """Refuse what is no ``ToolOffset``.

    Args:
        name: The argument.
        offset: What was given.

    Raises:
        ConfigError: It names the argument, and how an offset is written.
    """
    if not isinstance(offset, ToolOffset):
        from robolink.model._arguments import not_of_class

        raise not_of_class(name, offset, ToolOffset)


def of_no_tool(values: Sequence[float]) -> bool:
    """Return whether one of these numbers is one that no tool has, in any unit."""
    return any(value and not _LEAST < abs(value) < _MOST for value in values)


def describe_offset(offset: ToolOffset | None) -> str:
    """Return an offset as a person reads it; V and W only where they are not 0."""
    if offset is None:
        return tr("undefined")
    require_offset("offset", offset)
    if offset.of_no_tool:
        numbers = ", ".join(f"{value:g}" for value in offset.components())
        return tr("not the values of a tool ({numbers})", numbers=numbers)
    return described(offset.components())


def put_right(offset: ToolOffset | None) -> str:
    """Return how a person corrects a tool with impossible values; empty for other tools."""
    if offset is None or not offset.of_no_tool:
        return ""
    return tr(
        "'robolink tool set' gives such a tool other values, 'robolink tool clear' removes it."
    )


def plain_offset(offset: ToolOffset | None) -> list[float] | None:
    """Return an offset as plain JSON, ``None`` for an undefined tool."""
    if offset is None:
        return None
    require_offset("offset", offset)
    return list(offset.components())


def read_offset(value: object) -> ToolOffset | None:
    """Return the offset from the output of :func:`plain_offset`.

    Raises:
        ConfigError: It is not such a value.
    """
    if value is None:
        return None
    if isinstance(value, list) and len(value) == 6:
        return ToolOffset(*value)
    raise ConfigError(
        tr("A recorded tool offset cannot be understood: {value!r}.", value=value),
        remedy=tr("Read the tool from the controller and compare it by hand."),
    )


class Expect(Enum):
    """How a write may be made without naming the old value."""

    ANY = "any"


ANY: Final = Expect.ANY
"""Pass as ``expected`` to write over any stored value. Recorded as unconditional."""

Expected = ToolOffset | None | Literal[Expect.ANY]
"""Value that the caller expects: an offset, ``None`` for undefined, or :data:`ANY`."""


def tool_changed(
    tool: int,
    found: ToolOffset | None,
    expected: ToolOffset | None,
    *,
    controller: str = "",
    request: str = "",
) -> ToolChangedError:
    """Return the error for a tool that does not hold the value that its writer expects.

    Args:
        tool: Number of the tool.
        found: The value found, ``None`` for undefined.
        expected: The value that its writer expects.
        controller: The controller's identity, for the error.
        request: What was asked, for the error.

    Example:
        >>> from robolink import ToolOffset
        >>> from robolink.model import tool_changed
        >>> error = tool_changed(2, found=ToolOffset(5, 6, -70), expected=None)
        >>> type(error).__name__
        'ToolChangedError'
    """
    return ToolChangedError(
        tr(
            "Tool {tool} holds {found}, not {expected} as expected; nothing was written.",
            tool=tool,
            found=describe_offset(found),
            expected=describe_offset(expected),
        ),
        remedy=tr("Read the tool again. Find what set it: TLSet, the pendant, a restored project."),
        controller=controller,
        request=request,
    )


@dataclass(frozen=True, slots=True)
class ToolReceipt:
    """The result of a write or clear, as confirmed by reading back.

    ``skipped`` means that the value was already there and nothing was written.
    ``None`` stands for an undefined tool.
    """

    tool: int
    before: ToolOffset | None
    requested: ToolOffset | None
    read_back: ToolOffset | None
    skipped: bool = False
    unconditional: bool = False


class ToolTable(Protocol):
    """The tool offsets stored in a controller."""

    def indices(self) -> Sequence[int]:
        """Return the tool numbers that can be written."""

    def same(self, a: ToolOffset | None, b: ToolOffset | None) -> bool:
        """Return whether the controller would store both alike; undefined equals undefined only."""

    def require_writable(self, tool: int) -> None:
        """Refuse a tool number that cannot be written; sends nothing.

        Raises:
            ReservedToolError, ToolIndexError: As :meth:`write` would.
        """

    def read_all(self) -> dict[int, ToolOffset | None]:
        """Read every writable tool; an undefined one is ``None``."""

    def read(self, tool: int) -> ToolOffset | None:
        """Read one tool, ``None`` when it is undefined.

        Raises:
            ToolIndexError: There is no such tool.
        """

    def doubts(self, tools: Collection[int]) -> tuple[str, ...]:
        """Return, in sentences, why the values that are read may not be the active ones.

        Args:
            tools: The tools about to be changed.
        """

    def write(
        self, tool: int, offset: ToolOffset, *, expected: Expected, wait_s: float | None = None
    ) -> ToolReceipt:
        """Write ``offset`` if the stored value is ``expected``, then read it back.

        Args:
            tool: Its number, 1 and more.
            offset: The new value, mm and degrees; rounded to what the controller stores.
            expected: The value expected to be stored, ``None`` for undefined, ``ANY`` for anything.
            wait_s: How long to wait for other threads and programs that are working, in seconds,
                0 not at all; ``None`` for the controller's ``patience.wait_s``.

        Raises:
            ReservedToolError: Tool 0.
            ToolIndexError: There is no such tool.
            ToolChangedError: Another value is stored; nothing was written.
            ReadBackError: Another value came back.
            NotReadyError: The state would not allow a write; nothing was written.
            BusyError: Another thread or program is working; nothing was written.
            OutcomeUnknownError: No answer came to the write.

        Example:
            >>> import robolink
            >>> new = robolink.ToolOffset(12.3, -3.7, -20)
            >>> with robolink.connect("epson+sim://write-example") as controller:
            ...     receipt = controller.tools.write(1, new, expected=controller.tools.read(1))
            >>> receipt.read_back.x_mm, receipt.skipped
            (12.3, False)
        """

    def preview_write(self, tool: int, offset: ToolOffset) -> tuple[str, ...]:
        """Return what :meth:`write` would send besides its reads, as sent on the wire.

        Empty when the value is stored already. Reads only; raises what the write would.
        """

    def preview_clear(self, tool: int, *, then_select: int | None = None) -> tuple[str, ...]:
        """Return what :meth:`clear` would send besides its reads; raises what it would."""

    def preview_select(self, tool: int) -> tuple[str, ...]:
        """Return what :meth:`select` would send besides its reads."""

    def clear(
        self,
        tool: int,
        *,
        expected: Expected,
        then_select: int | None = None,
        wait_s: float | None = None,
    ) -> ToolReceipt:
        """Remove a definition; same conditions and errors as :meth:`write`.

        Args:
            tool: Its number.
            expected: The value expected to be stored.
            then_select: The tool to select first, if ``tool`` is selected; 0 is the flange.
                Otherwise the selection stays.
            wait_s: As for :meth:`write`.

        Raises:
            SelectedToolError: The tool is selected and no other one is named; nothing was sent.
            UndefinedToolError: The tool named has no definition; nothing was cleared.

        Example:
            >>> import robolink
            >>> new = robolink.ToolOffset(5, 6, -70)
            >>> with robolink.connect("epson+sim://clear-example") as controller:
            ...     held = controller.tools.write(2, new, expected=None).read_back
            ...     receipt = controller.tools.clear(2, expected=held)
            ...     print(controller.tools.read(2))
            None
        """

    def selected(self) -> int | None:
        """Return the number of the selected tool, 0 for the flange.

        ``None`` if the controller does not report it.
        """

    def select(self, tool: int, *, wait_s: float | None = None) -> None:
        """Select a tool and read the selection back.

        Args:
            tool: Its number, 0 for the flange.
            wait_s: As for :meth:`write`.

        Raises:
            UndefinedToolError: The tool has no definition.
        """


def read_for_verdict(
    tools: ToolTable, tool: int, known: Iterable[ToolOffset | None]
) -> ToolOffset | None:
    """Read a tool whose value decides what happens to a change, ``None`` when it is undefined.

    A value that nobody is known to have written counts when it was read twice: the checksum of
    Remote RS232 does not notice two bytes that changed places (docs/reference/epson.md 2.1).

    Args:
        tools: The table.
        tool: Its number.
        known: The values to expect: the old one, the new one.

    Raises:
        UnclearAnswerError: Each of three reads shows another value.
        ToolIndexError: There is no such tool.

    Example:
        >>> import robolink
        >>> from robolink.model import read_for_verdict
        >>> with robolink.connect("epson+sim://verdict-example") as controller:
        ...     old = controller.tools.read(1)
        ...     new = robolink.ToolOffset(12.3, -3.7, -20)
        ...     now = read_for_verdict(controller.tools, 1, (old, new))
        >>> now == old
        True
    """
    looks = list(known)
    for _ in range(_LOOKS):
        now = tools.read(tool)
        if any(tools.same(now, one) for one in looks):
            return now
        looks.append(now)
    raise UnclearAnswerError(
        tr("Tool {tool} reads back differently each time.", tool=tool),
        remedy=tr("Nothing was written. Check the cable, then try again."),
    )


@dataclass(frozen=True, slots=True)
class Jump:
    """How far a new value moves the tip of a tool from where the stored one has it.

    Attributes:
        length_mm: How far apart the tips are.
        angle_deg: By how much the orientations differ: one turn about one axis, 0 to 180.
    """

    length_mm: float
    angle_deg: float

    @classmethod
    def between(cls, before: ToolOffset, after: ToolOffset) -> "Jump":
        """Return how far ``after`` is from ``before``."""
        length_mm = math.dist(before.components()[:3], after.components()[:3])
        ours, theirs = _quaternion(before), _quaternion(after)
        # By the chord, because the cosine of a small angle is too insensitive; q and -q are the
        # same orientation, so the nearer one counts.
        opposite = (-a for a in ours)
        chord = min(math.dist(ours, theirs), math.dist(tuple(opposite), theirs))
        return cls(length_mm, math.degrees(4.0 * math.asin(min(1.0, chord / 2.0))))

    def exceeds(self, length_mm: float | None, angle_deg: float | None) -> bool:
        """Return whether it is larger than a limit; ``None`` is no limit."""
        too_far = length_mm is not None and self.length_mm > length_mm
        return too_far or (angle_deg is not None and self.angle_deg > angle_deg)


def _quaternion(offset: ToolOffset) -> tuple[float, float, float, float]:
    """Return the unit quaternion of R = Rz(U) Ry(V) Rx(W)."""
    (cu, su), (cv, sv), (cw, sw) = (
        (math.cos(half), math.sin(half))
        for half in (math.radians(deg) / 2.0 for deg in offset.components()[3:])
    )
    return (
        cu * cv * cw + su * sv * sw,
        cu * cv * sw - su * sv * cw,
        cu * sv * cw + su * cv * sw,
        su * cv * cw - cu * sv * sw,
    )


@runtime_checkable
class KinematicToolTable(Protocol):
    """A tool table of a machine whose kinematics does not carry every tool."""

    def require_measurable(self, components: Sequence[str]) -> None:
        """Refuse to measure what the machine could not accept afterwards; only reads.

        Args:
            components: ``x_mm``, ``y_mm``, ``z_mm`` and other parts of a tool.

        Raises:
            RejectedError: Names the kinematics, the impossible components, and why.
        """
