"""From named columns to poses: what every table does, whether its rows are lines or objects."""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Final

from robolink.messages import tr
from robolink.model import Hand
from robolink.pose_tables.questions import (
    MOST_RAD,
    may_be_degrees,
    may_be_radians,
    which_angle_unit,
    which_rotation,
)
from robolink.pose_tables.refusals import NotFiniteText, OpenQuestion, UnclearText, UnusableText
from robolink.pose_tables.tabular.header import (
    COUNTS,
    LENGTHS,
    SKIPPED,
    WORDS,
    nearly_named,
    require_each_once,
)
from robolink.pose_tables.tabular.rotations import TurnColumns, turn_columns
from robolink.pose_tables.values import AngleUnit, ColumnHead, LengthUnit, RawPose, ReadingChoices

_BENIGN: Final = frozenset(
    {
        *("time", "timestamp", "stamp", "t", "date", "seq", "count", "status"),
        *("speed", "force", "temperature", "rms", "residual", "error"),
    }
)
"""Columns of numbers that nobody takes for a turn."""

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
        """The unit that the columns say.

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
        """Tell for each column whether it holds numbers throughout."""
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
                # A row may say nothing of all that a robot adds to a pose, as a typed one does.
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
    """Refuse a column that says nothing, but is one letter away from one that would.

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
