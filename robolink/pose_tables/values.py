"""What a file of poses holds, what a person adds to it, and how it was read."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Final

from robolink.errors import AmbiguousPosesError, CalibrationError, ConfigError
from robolink.messages import joined, listed, tr
from robolink.model import Pose


class LengthUnit(StrEnum):
    """Units of length that files of poses come in."""

    MM = "mm"
    CM = "cm"
    M = "m"
    INCH = "in"

    @property
    def mm(self) -> float:
        """How many mm one of it is."""
        return {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}[self.value]


class AngleUnit(StrEnum):
    """Units of angle that files of poses come in."""

    DEG = "deg"
    RAD = "rad"


@dataclass(frozen=True, slots=True)
class ColumnHead:
    """What one column holds.

    Attributes:
        meaning: ``x``, ``u``, ``qw``, ``name`` and so on (docs/reference/pose_files.md 4), ``-``
            for nothing about a pose.
        unit: The unit that its name says.
        text: As the file has it.
        from_ros: Whether the name is that of a ROS message, whose lengths are metres.
    """

    meaning: str
    unit: LengthUnit | AngleUnit | None = None
    text: str = ""
    from_ros: bool = False


@dataclass(frozen=True, slots=True)
class TabledPose:
    """One pose of a file.

    Attributes:
        pose: In mm and degrees; tool and local as far as the file says them.
        name: What the file calls it; empty where it does not.
        number: Its number in the file's own count, a point's for example.
        line: Line of the file where it begins, from 1; in JSON the place in the list.
        stated: What the file says besides X, Y and U, of ``z_mm``, ``v_deg``, ``w_deg`` and
            ``local``; the rest of these is 0 in ``pose`` because the file is silent.
    """

    pose: Pose
    name: str = ""
    number: int | None = None
    line: int = 0
    stated: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class ReadingChoices:
    """What a person states about a file, because the file does not.

    Attributes:
        columns: A name for every column, ``-`` for one to skip; ``x,y,z,u`` for example.
        length: ``mm``, ``m`` or ``in``.
        euler: Name of the rule by which the angles turn (docs/reference/pose_files.md 1).
    """

    columns: str | None = None
    length: str | None = None
    euler: str | None = None


@dataclass(frozen=True, slots=True)
class HowRead:
    """How a file was read, for a person to check.

    Attributes:
        encoding: Of the bytes.
        layout: Which kind of file it was taken for.
        length: Unit of its lengths.
        length_by: Who says so: the ``file``, its ``format``, an ``option`` or the ``default``.
        angle: Unit of its angles; empty where its rotations are no angles.
        rotation: How its rotations were understood.
        separator: What stands between columns; empty where there are none.
        decimal: The decimal sign of a table.
        columns: What each column was taken for, ``-`` for one that was skipped.
        ignored: Names of columns that say nothing about a pose.
        skipped: How many entries are no taught poses: joints, untaught points.
    """

    encoding: str
    layout: str
    length: LengthUnit
    length_by: str
    rotation: str
    angle: str = ""
    separator: str = ""
    decimal: str = ""
    columns: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    skipped: int = 0


@dataclass(frozen=True, slots=True)
class PoseTable:
    """The poses of a file, in its order, and how it was read."""

    entries: tuple[TabledPose, ...]
    how: HowRead

    @property
    def poses(self) -> tuple[Pose, ...]:
        """The poses alone."""
        return tuple(entry.pose for entry in self.entries)


NOTHING_SAID: Final = ReadingChoices()


@dataclass(slots=True)
class RawPose:
    """One pose as a format gives it: lengths in the file's unit, angles turned into U, V, W.

    Attributes:
        line: As of :class:`TabledPose`.
        position: X, Y, Z in the file's unit.
        uvw_deg: U, V, W in degrees.
        given: Name, number, hand, local and tool, as far as the file says them.
        stated: As of :class:`TabledPose`.
    """

    line: int
    position: tuple[float, float, float]
    uvw_deg: tuple[float, float, float]
    given: dict[str, object] = field(default_factory=dict)
    stated: frozenset[str] = frozenset({"z_mm", "v_deg", "w_deg"})


@dataclass(slots=True)
class RawTable:
    """What a format makes of a text, before its unit of length is known.

    Attributes:
        layout: Name of the format.
        poses: The poses.
        rotation: How rotations were understood.
        length: The unit, where the file or its format says one.
        stated_length: Whether the file itself says it, and not only the format's definition.
        unit_in_comment: A comment that speaks of a unit which nothing else says.
        has_lines: Whether ``line`` of its poses is a line; else it counts the poses.
        angle: Unit of angles, separator, decimal sign, columns, ignored, skipped: as of
            :class:`HowRead`.
    """

    layout: str
    poses: list[RawPose]
    rotation: str
    length: LengthUnit | None = None
    stated_length: bool = False
    unit_in_comment: str = ""
    angle: str = ""
    separator: str = ""
    decimal: str = ""
    columns: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    skipped: int = 0
    has_lines: bool = True


class UnusableText(Exception):
    """A text is no table of poses.

    Attributes:
        why: The reason, the second half of a sentence.
        line: Where, from 1; 0 when it is about the whole.
        pose: The same for what has no lines of its own: the number of the pose, from 1.
    """

    def __init__(self, why: str, line: int = 0, pose: int = 0) -> None:
        super().__init__(why)
        self.why = why
        self.line = line
        self.pose = pose


@contextmanager
def at_line(line: int) -> Iterator[None]:
    """Add the line to an error of the block that names none itself."""
    try:
        yield
    except UnusableText as cause:
        cause.line = cause.line or (0 if cause.pose else line)
        raise


@contextmanager
def at_pose(number: int) -> Iterator[None]:
    """Add the number of the pose to an error of the block that names no place."""
    try:
        yield
    except UnusableText as cause:
        cause.pose = cause.pose or (0 if cause.line else number)
        raise


class NotFiniteText(UnusableText):
    """Something else is where a finite number must be."""

    def __init__(self, name: str, value: object, line: int = 0) -> None:
        super().__init__(tr("{name} is {value!r}", name=name, value=value), line)


@dataclass(frozen=True, slots=True)
class OpenQuestion:
    """Something that a file does not say.

    Attributes:
        about: ``columns``, ``length`` or ``euler``.
        what: What is not said, the second half of a sentence.
        way: How to say it, a sentence.
        readings: What can be meant, the likeliest first.
    """

    about: str
    what: str
    way: str
    readings: tuple[str, ...] = ()


class UnclearText(Exception):
    """A text can be read in more than one way."""

    def __init__(self, *questions: OpenQuestion) -> None:
        super().__init__(*questions)
        self.questions = questions


def refused(path: Path, cause: UnusableText) -> ConfigError | CalibrationError:
    """Return the error for a file that cannot be used: ``non_finite`` by that name."""
    why = cause.why
    if cause.line:
        why = tr("line {line}: {why}", line=cause.line, why=why)
    elif cause.pose:
        why = tr("pose {number}: {why}", number=cause.pose, why=why)
    what = tr("{path} cannot be used: {why}.", path=path, why=why)
    remedy = tr("Nothing was sent. Correct the file or name another one.")
    if isinstance(cause, NotFiniteText):
        return CalibrationError("non_finite", what, remedy=remedy)
    return ConfigError(what, remedy=remedy)


def unclear(path: Path, questions: Sequence[OpenQuestion]) -> AmbiguousPosesError:
    """Return the error for a file that leaves something open."""
    return AmbiguousPosesError(
        listed(
            tr("{path} is not clear:", path=path),
            [
                line
                for question in questions
                for line in (question.what, *(f"  {one}" for one in question.readings))
            ],
        ),
        asks=tuple(question.about for question in questions),
        remedy=joined(" ", [question.way for question in questions]),
    )
