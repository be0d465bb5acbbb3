"""From named columns to poses: what every table does, whether its rows are lines or objects."""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink.model import Hand
from robolink.pose_tables import orientation
from robolink.pose_tables.orientation import EPSON, RotationRule, order_for, rule_named
from robolink.pose_tables.questions import (
    MOST_RAD,
    may_be_degrees,
    may_be_radians,
    which_angle_unit,
    which_rotation,
    which_rule,
)
from robolink.pose_tables.tabular.header import (
    ANGLES,
    COUNTS,
    LENGTHS,
    MATRIX,
    QUATERNION,
    SKIPPED,
    WORDS,
    nearly_named,
    require_each_once,
)
from robolink.pose_tables.values import (
    AngleUnit,
    ColumnHead,
    LengthUnit,
    NotFiniteText,
    OpenQuestion,
    RawPose,
    ReadingChoices,
    UnclearText,
    UnusableText,
)

Uvw = tuple[float, float, float]

_WHOLE: Final = (
    {"u", "v", "w"},
    {"a", "b", "c"},
    {"r", "p", "w"},
    {"rx", "ry", "rz"},
    {"o", "a", "t"},
    {"roll", "pitch", "yaw"},
)
_ONLY_TOGETHER: Final = ({"o", "t"}, {"p"})
"""Letters that mean time, point or something else more often than one of three angles."""


@dataclass(frozen=True, slots=True)
class TurnColumns:
    """Which columns turn a pose, and how.

    Attributes:
        names: Their meanings, in the order in which :attr:`turn` takes them.
        text: The rule, for a person.
        turn: Makes U, V, W in degrees of their values and a line's number.
        optional: Whether all but the first may be empty, which is 0.
        angle: The unit of the angles, ``None`` where there are none.
        unit_said: Whether the file, or the person, says the unit.
        complete: Whether nothing but these can turn the pose.
        vector: Whether it is a rotation vector.
    """

    names: tuple[str, ...]
    text: str
    turn: Callable[[Sequence[float], int], Uvw]
    optional: bool = False
    angle: AngleUnit | None = None
    unit_said: bool = True
    complete: bool = True
    vector: bool = False


def turn_columns(heads: Sequence[ColumnHead], euler: str | None) -> TurnColumns:
    """Return how the columns turn a pose.

    Args:
        heads: All columns.
        euler: The rule that a person names.

    Raises:
        UnclearText: The rule, or the columns, have to be named.
        UnusableText: The columns contradict each other or the rule.
    """
    present = [head.meaning for head in heads]
    quaternion = set(present) & set(QUATERNION)
    matrix = set(present) & set(MATRIX)
    angles = _angles(present)
    if quaternion == {"qx", "qy", "qz"} and "w" in angles:
        quaternion.add("w")
        angles.remove("w")
    if sum(map(bool, (quaternion, matrix, angles))) > 1:
        raise UnclearText(which_rotation(heads))
    if angles:
        return _by_angles(angles, heads, rule_named(euler) if euler else None)
    if euler and (quaternion or matrix):
        raise UnusableText(tr("a rule for angles was given, but the file has no angles"))
    if len(quaternion) == len(QUATERNION):
        scalar = "qw" if "qw" in quaternion else "w"
        return TurnColumns(("qx", "qy", "qz", scalar), "quaternion QX QY QZ QW", _by_quaternion)
    if len(matrix) == len(MATRIX):
        return TurnColumns(MATRIX, "matrix R11 .. R33", _by_matrix)
    raise UnclearText(which_rotation(heads))


def _angles(present: Sequence[str]) -> list[str]:
    angles = [name for name in present if name in ANGLES]
    for odd in _ONLY_TOGETHER:
        whole = [kind for kind in _WHOLE if odd < kind and kind <= set(angles)]
        if not whole:
            angles = [name for name in angles if name not in odd]
    return angles


def _by_angles(
    names: Sequence[str], heads: Sequence[ColumnHead], rule: RotationRule | None
) -> TurnColumns:
    units = {head.unit for head in heads if head.meaning in names}
    if len(units) > 1:
        raise UnusableText(tr("its angles have different units"))
    (said,) = units
    unit = said if isinstance(said, AngleUnit) else None
    if set(names) == {"u"} and rule in (None, EPSON):
        return _angles_by(EPSON, ("u",), unit)
    if set(names) == {"rz"} and rule is None:
        return _angles_by(EPSON, ("rz",), unit)  # about Z, vector and angle are the same
    if set(names) not in _WHOLE:
        raise UnclearText(which_rotation(heads))
    if rule is None and set(names) == set(EPSON.letters):
        rule = EPSON
    if rule is None:
        raise UnclearText(which_rule(names))
    order = order_for(rule, names)
    if order is None:
        called = ", ".join(rule.letters).upper()
        raise UnusableText(
            tr("angles of {rule} are called {letters}", rule=rule.name, letters=called)
        )
    return _angles_by(rule, tuple(names[place] for place in order), unit)


def _angles_by(rule: RotationRule, names: tuple[str, ...], unit: AngleUnit | None) -> TurnColumns:
    default = AngleUnit.DEG if rule.axes else AngleUnit.RAD
    radians = (unit or default) is AngleUnit.RAD

    def turn(values: Sequence[float], line: int) -> Uvw:  # noqa: ARG001 - as the others
        if rule is EPSON:
            found = tuple(map(math.degrees, values)) if radians else tuple(values)
            return (*found, *(0.0,) * (3 - len(found)))  # type: ignore[return-value]
        turned = values if radians else tuple(map(math.radians, values))
        return orientation.uvw_deg(rule.matrix(turned))

    return TurnColumns(
        names,
        rule.formula,
        turn,
        optional=rule is EPSON,
        angle=unit or default,
        unit_said=unit is not None,
        complete=len(names) == 3,
        vector=not rule.axes,
    )


def _by_quaternion(values: Sequence[float], line: int) -> Uvw:
    x, y, z, scalar = values
    return orientation.uvw_deg(orientation.from_quaternion(x, y, z, scalar, line))


def _by_matrix(values: Sequence[float], line: int) -> Uvw:
    return orientation.uvw_deg(orientation.checked(values, line))


_BENIGN: Final = frozenset(
    {
        *("time", "timestamp", "stamp", "t", "date", "seq", "count", "status"),
        *("speed", "force", "temperature", "rms", "residual", "error"),
    }
)
"""Columns of numbers that are never mistaken for angles."""

_HANDS: Final = {
    **dict.fromkeys(("right", "r", "/r", "righty", "1"), Hand.RIGHT),
    **dict.fromkeys(("left", "l", "/l", "lefty", "2"), Hand.LEFT),
}


class PoseColumns:
    """Makes poses of rows.

    Attributes:
        turns: How the columns turn a pose, ``None`` while that is asked.
        questions: What has to be asked before there can be a pose.

    Args:
        heads: What the columns hold.
        choices: What a person says about the file.
        number: Makes a number of a cell, ``nan`` of what is none.

    Raises:
        UnusableText: The columns contradict each other, or do not make a pose.
    """

    def __init__(
        self,
        heads: Sequence[ColumnHead],
        choices: ReadingChoices,
        number: Callable[[object], float],
    ) -> None:
        require_each_once(heads)
        _refuse_misspelt(heads)
        self._heads = tuple(heads)
        self._number = number
        self._place = {head.meaning: place for place, head in enumerate(heads)}
        self.questions: list[OpenQuestion] = []
        self.turns: TurnColumns | None = None
        for name in ("x", "y"):
            if name not in self._place:
                raise UnusableText(tr("no column is called {name}", name=name.upper()))
        try:
            self.turns = turn_columns(heads, choices.euler)
        except UnclearText as unclear:
            self.questions += unclear.questions

    @property
    def length(self) -> LengthUnit | None:
        """The unit that the columns state.

        Raises:
            UnusableText: They say more than one.
        """
        units = {h.unit for h in self._heads if h.meaning in LENGTHS}
        if len(units - {None}) > 1 or (None in units and units - {None, LengthUnit.MM}):
            raise UnusableText(tr("its lengths have different units"))
        return next((unit for unit in units if isinstance(unit, LengthUnit)), None)

    @property
    def from_ros(self) -> bool:
        """Whether the columns are those of a ROS message."""
        return any(head.from_ros for head in self._heads)

    @property
    def ignored(self) -> tuple[str, ...]:
        """Names of columns that say nothing about a pose."""
        return tuple(h.text.strip() for h in self._heads if h.meaning == SKIPPED and h.text.strip())

    def asked(self, rows: Sequence[tuple[int, Sequence[object]]]) -> list[OpenQuestion]:
        """Return the questions, with examples that fit the rows."""
        if any(question.about == "columns" for question in self.questions):
            rest = [question for question in self.questions if question.about != "columns"]
            return [which_rotation(self._heads, self._numeric(rows)), *rest]
        return list(self.questions)

    def _numeric(self, rows: Sequence[tuple[int, Sequence[object]]]) -> list[bool]:
        """Return for each column whether it holds numbers throughout."""
        return [
            bool(rows) and all(math.isfinite(self._number(row[place])) for _, row in rows)
            for place in range(len(self._heads))
        ]

    def angle_question(self, rows: Sequence[tuple[int, Sequence[object]]]) -> OpenQuestion:
        """Return the question for the unit of the angles in rows."""
        names = self.turns.names if self.turns else ()
        places = [self._place[name] for name in names]
        angles = [abs(self._number(row[place])) for _, row in rows for place in places]
        return which_angle_unit(self._heads, names, max(filter(math.isfinite, angles), default=0.0))

    def positions(self, rows: Iterable[tuple[int, Sequence[object]]]) -> list[tuple[float, ...]]:
        """Return X, Y, Z of rows, 0 where there is no Z."""
        return [self._position(line, row)[0] for line, row in rows]

    def poses(self, rows: Sequence[tuple[int, Sequence[object]]]) -> list[RawPose]:
        """Return the poses of rows, each with the number of its line.

        Raises:
            UnclearText: Something has to be asked.
            UnusableText: A row is no pose.
        """
        turns = self.turns
        if turns is None:
            raise UnclearText(*self.questions)
        if not turns.complete or "z" not in self._place:
            self._require_nothing_else_turns(rows)
        self._require_alike(rows)
        places = [self._place[name] for name in turns.names]
        values = [self._values(line, row, places, turns) for line, row in rows]
        self._require_unit(turns, values, rows)
        found = []
        for (line, row), angles in zip(rows, values, strict=True):
            position, stated = self._position(line, row)
            if len(turns.names) > 1 and None not in angles:
                stated |= {"v_deg", "w_deg"}
            numbers = [0.0 if angle is None else angle for angle in angles]
            found.append(
                RawPose(line, position, turns.turn(numbers, line), self._given(line, row), stated)
            )
        return found

    def _require_alike(self, rows: Sequence[tuple[int, Sequence[object]]]) -> None:
        """Refuse a cell that is empty in some rows only: there a number is missing."""
        frames = [self._place[name] for name in _OF_FRAME if name in self._place]
        for name, place in self._place.items():
            if name in ("name", "number"):
                continue
            filled = any(row[place] not in ("", None) for _, row in rows)
            for line, row in rows if filled else ():
                # A row may leave out everything that a robot adds to a pose, as a typed row does.
                silent = len(frames) > 1 and all(row[one] in ("", None) for one in frames)
                if row[place] in ("", None) and not (place in frames and silent):
                    text = self._heads[place].text.strip() or name
                    raise UnusableText(tr("there is no {name}", name=text), line)

    def _position(
        self, line: int, row: Sequence[object]
    ) -> tuple[tuple[float, float, float], frozenset[str]]:
        x, y = (self._required(line, row, name) for name in ("x", "y"))
        place = self._place.get("z")
        if place is None or row[place] in ("", None):
            return (x, y, 0.0), _NOTHING
        return (x, y, self._required(line, row, "z")), _Z

    def _required(self, line: int, row: Sequence[object], name: str) -> float:
        cell = row[self._place[name]]
        value = self._number(cell)
        if not math.isfinite(value):
            text = self._heads[self._place[name]].text.strip() or name
            if cell in ("", None):
                raise UnusableText(tr("there is no {name}", name=text), line)
            raise NotFiniteText(text, cell, line)
        return value

    def _values(
        self, line: int, row: Sequence[object], places: Sequence[int], turns: TurnColumns
    ) -> list[float | None]:
        found: list[float | None] = []
        for name, place in zip(turns.names, places, strict=True):
            if found and turns.optional and row[place] in ("", None):
                found.append(None)
            else:
                found.append(self._required(line, row, name))
        return found

    def _require_unit(
        self,
        turns: TurnColumns,
        values: Sequence[Sequence[float | None]],
        rows: Sequence[tuple[int, Sequence[object]]],
    ) -> None:
        if turns.angle is AngleUnit.RAD and not turns.vector:
            for (line, _), row in zip(rows, values, strict=True):
                if any(abs(angle or 0.0) > MOST_RAD for angle in row):
                    raise UnusableText(tr("its angles are too large for radians"), line)
        if turns.unit_said or turns.angle is None:
            return
        numbers = [[angle or 0.0 for angle in row] for row in values]
        doubtful = may_be_degrees(numbers) if turns.vector else may_be_radians(numbers)
        if doubtful:
            raise UnclearText(self.angle_question(rows))

    def _require_nothing_else_turns(self, rows: Sequence[tuple[int, Sequence[object]]]) -> None:
        """Ask about columns of numbers without a known name: one may be a tilt, or Z."""
        turns = self.turns
        used = {*LENGTHS, *WORDS, *COUNTS, *(turns.names if turns else ())}
        for place, head in enumerate(self._heads):
            if head.meaning in used or head.text.strip().lower() == SKIPPED:
                continue
            tilt_only = turns is None or not turns.complete
            if tilt_only and head.text.strip().lower() in _BENIGN:
                continue
            numbers = [self._number(row[place]) for _, row in rows]
            counted = {b - a for a, b in itertools.pairwise(numbers)} == {1.0}
            if numbers and all(map(math.isfinite, numbers)) and not counted:
                raise UnclearText(which_rotation(self._heads, self._numeric(rows)))

    def _given(self, line: int, row: Sequence[object]) -> dict[str, object]:
        given: dict[str, object] = {}
        for name in ("name", "hand", *COUNTS):
            place = self._place.get(name)
            cell = None if place is None else row[place]
            if cell is None or cell == "":
                continue
            if name == "name":
                given[name] = str(cell)
            elif name == "hand":
                given[name] = _hand(line, cell)
            else:
                self._count(given, name, cell, line)
        return given

    def _count(self, given: dict[str, object], name: str, cell: object, line: int) -> None:
        value = self._number(cell)
        if math.isfinite(value) and value == int(value):
            given[name] = int(value)
        elif name == "number":
            given.setdefault("name", str(cell))
        else:
            raise UnusableText(tr("{name} is not a whole number", name=name), line)


def _refuse_misspelt(heads: Sequence[ColumnHead]) -> None:
    """Refuse a column without a meaning whose name is one letter away from a known one.

    Raises:
        UnusableText: There is one.
    """
    present = {head.meaning for head in heads}
    for head in heads:
        text = head.text.strip()
        meant = nearly_named(text) if head.meaning == SKIPPED and text != SKIPPED else ""
        if meant and meant.partition("_")[0] not in present:
            raise UnusableText(
                tr("column {name!r} is not known; is {meant!r} meant?", name=text, meant=meant)
            )


_OF_FRAME: Final = ("hand", "local", "tool")
_NOTHING: Final = frozenset[str]()
_Z: Final = frozenset({"z_mm"})


def _hand(line: int, cell: object) -> Hand:
    hand = _HANDS.get(str(cell).strip().lower())
    if hand is None:
        raise UnusableText(tr("its hand is other than right or left"), line)
    return hand
