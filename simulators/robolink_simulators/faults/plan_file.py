"""Fault plans in files: ``[[fault]]`` by ``[[fault]]``, and ``[drawn]`` from the seed.

docs/fault-plans.md, "The file" explains the keys.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final, get_args

from robolink.errors import ConfigError
from robolink.files.key_problems import at_least, at_most, is_not_known, one_of
from robolink.files.toml import FileKind, Problem
from robolink.messages import tr
from robolink_simulators.faults.drawn import (
    MOST_EXCHANGES,
    FaultRates,
    drawn_faults,
    drawn_plc_faults,
)
from robolink_simulators.faults.fieldbus import Order, PlcFault, PlcFaultAction
from robolink_simulators.faults.links import (
    MAILBOX_LINKS,
    AnyAction,
    FaultNotPossibleError,
    LinkKind,
    require_possible,
)
from robolink_simulators.faults.stream import EXCEPTION_CODES, Fault, FaultAction

SCHEMA: Final = "robolink/faults/1"
MOST_FAULTS: Final = 2000
_DAY_S: Final = 86_400

FAULT_FILE: Final = FileKind(
    named=lambda path: tr("The fault plan {path}", path=path),
    unreadable_remedy=lambda: tr("docs/fault-plans.md shows what a fault plan looks like."),
    wrong_remedy=lambda: tr("Correct it; docs/fault-plans.md explains every key."),
)

_Number = tuple[type, float, float]
_NUMBERS: Final[Mapping[str, _Number]] = {
    "on_exchange": (int, 0, MOST_EXCHANGES),
    "seconds": (float, 0, _DAY_S),
    "code": (int, 0, 65_535),
    "position": (int, 0, 65_535),
    "bit": (int, 0, 15),
    "every": (int, 0, MOST_EXCHANGES),
    "rate": (float, 0, 1),
    "exchanges": (int, 0, MOST_EXCHANGES),
    "seed": (int, 0, 2**63 - 1),
}
_OF_FILE: Final = ("schema", "link", "seed", "fault", "drawn")
_OF_DRAWN: Final = ("rate", "exchanges", "actions", "match")


@dataclass(frozen=True, slots=True)
class FaultFile:
    """The content of a fault plan.

    Attributes:
        link: The link that it was written and drawn for.
        seed: Draws what it leaves open.
        faults: What is planned: all of a stream, or all of a mailbox.
    """

    link: LinkKind
    seed: int
    faults: tuple[Fault, ...] | tuple[PlcFault, ...]


def read_fault_file(path: Path) -> FaultFile:
    """Read a fault plan.

    Raises:
        ConfigError: It cannot be read, or something in it is wrong: all of it at once, each
            with its line and key.
    """
    content = FAULT_FILE.read(path)
    document = FAULT_FILE.parse(path, content)
    reader = _Reader(document, content.decode("utf-8-sig"))
    plan = reader.plan()
    if plan is None:
        raise FAULT_FILE.refusal(path, reader.problems)
    return plan


def faults_of_table(
    tables: Sequence[Mapping[str, object]], link: LinkKind
) -> tuple[Fault, ...] | tuple[PlcFault, ...]:
    """Return faults that were given as a file has them, one table each.

    Raises:
        FaultNotPossibleError: One of them cannot happen on this link.
        ConfigError: Something else is wrong with one; tells all of it.
    """
    for table in tables:
        _require_possible(table.get("action"), link)
    reader = _Reader({"schema": SCHEMA, "link": link, "fault": [*tables]}, "")
    plan = reader.plan()
    if plan is None:
        raise ConfigError(
            tr("The fault is wrong: {why}.", why="; ".join(map(str, reader.problems[:3]))),
            remedy=tr("docs/fault-plans.md explains every key."),
        )
    return plan.faults


def _require_possible(name: object, link: LinkKind) -> None:
    own, other = FaultAction.__members__, PlcFaultAction.__members__
    first, second = (other, own) if link in MAILBOX_LINKS else (own, other)
    action = first.get(str(name).upper()) or second.get(str(name).upper())
    if action is not None:
        require_possible(action, {link})


def fault_as_keys(fault: Fault | PlcFault) -> dict[str, object]:
    """Return a fault in the form of a file, without default values."""
    keys: dict[str, object] = {"action": fault.action.name.lower()}
    for field in fields(fault)[1:]:
        value = getattr(fault, field.name)
        if value != field.default:
            keys[field.name] = value
    return keys


class _Reader:
    """Turns a document into a plan, and notes all its errors."""

    def __init__(self, document: Mapping[str, object], text: str) -> None:
        self.problems: list[Problem] = []
        self._document = document
        self._lines = text.splitlines()
        self._mailbox = False

    def plan(self) -> FaultFile | None:
        """Return the plan, ``None`` if there are errors."""
        link = self._head()
        if link is None:
            return None
        self._mailbox = link in MAILBOX_LINKS
        seed = self._number(
            "seed", self._document.get("seed", 1), "seed", self._line("", 0, "seed")
        )
        faults = self._written(link)
        drawn = self._drawn(link, int(seed or 0))
        return None if self.problems else FaultFile(link, int(seed or 0), (*faults, *drawn))

    def _head(self) -> LinkKind | None:
        for key in self._document:
            if key not in _OF_FILE:
                self._object(key, is_not_known(key[:80], _OF_FILE), self._line("", 0, key))
        if self._document.get("schema") != SCHEMA:
            self._object("schema", one_of([SCHEMA]), self._line("", 0, "schema"))
        try:
            return LinkKind(str(self._document.get("link")))
        except ValueError:
            self._object("link", one_of(LinkKind), self._line("", 0, "link"))
            return None

    def _written(self, link: LinkKind) -> list[Any]:
        tables = self._document.get("fault", [])
        if not isinstance(tables, list) or not all(isinstance(it, dict) for it in tables):
            self._object("fault", tr("must be a table"), self._line("", 0, "fault"))
            return []
        if len(tables) > MOST_FAULTS:
            self._object("fault", tr("must hold at most {count}", count=MOST_FAULTS), 0)
            return []
        faults = [self._fault(number, table, link) for number, table in enumerate(tables, 1)]
        return [fault for fault in faults if fault is not None]

    def _fault(
        self, number: int, table: Mapping[str, object], link: LinkKind
    ) -> Fault | PlcFault | None:
        kind: Any = PlcFault if self._mailbox else Fault
        names = [field.name for field in fields(kind)]
        before = len(self.problems)
        values: dict[str, Any] = {}
        for key, value in table.items():
            line, where = self._line("fault", number, key), f"fault {number}, {key}"
            if key not in names:
                self._object(where, is_not_known(key[:80], names), line)
            elif key == "action":
                values[key] = self._action(where, value, link, line)
            else:
                values[key] = self._value(key, value, where, line)
        if "action" not in table:
            where = f"fault {number}, action"
            self._object(where, tr("is missing"), self._line("fault", number, ""))
        excepting = table.get("action") == FaultAction.MODBUS_EXCEPTION.name.lower()
        if excepting and values.get("code") not in EXCEPTION_CODES:
            where, line = f"fault {number}, code", self._line("fault", number, "code")
            self._object(where, one_of(map(str, EXCEPTION_CODES)), line)
        return kind(**values) if len(self.problems) == before else None

    def _action(self, where: str, value: object, link: LinkKind, line: int) -> AnyAction | None:
        family: Any = PlcFaultAction if self._mailbox else FaultAction
        other: Any = FaultAction if self._mailbox else PlcFaultAction
        names = [action.name.lower() for action in family]
        if value not in names and value not in [action.name.lower() for action in other]:
            self._object(where, is_not_known(str(value)[:80], names), line)
            return None
        action: AnyAction = (family if value in names else other)[str(value).upper()]
        try:
            require_possible(action, {link})
        except FaultNotPossibleError as error:
            self._object(where, str(error), line)
        return action

    def _value(self, key: str, value: object, where: str, line: int) -> object:
        if key == "match":
            return self._text(value, where, line)
        if key == "order":
            if value not in get_args(Order):
                self._object(where, one_of(get_args(Order)), line)
            return value
        number = self._number(key, value, where, line)
        if key == "bit" and not self._mailbox and number is not None and number > 7:
            self._object(where, at_most(7), line)
        return number

    def _drawn(self, link: LinkKind, seed: int) -> tuple[Any, ...]:
        table = self._document.get("drawn")
        if table is None:
            return ()
        if not isinstance(table, dict):
            self._object("drawn", tr("must be a table"), self._line("", 0, "drawn"))
            return ()
        before = len(self.problems)
        values: dict[str, Any] = {}
        for key, value in table.items():
            line, where = self._line("drawn", 1, key), f"drawn, {key}"
            if key not in _OF_DRAWN:
                self._object(where, is_not_known(key[:80], _OF_DRAWN), line)
            elif key == "actions":
                values[key] = self._actions(value, where, link, line)
            elif key == "match":
                values[key] = self._text(value, where, line)
            else:
                values[key] = self._number(key, value, where, line)
        if len(self.problems) > before:
            return ()
        rates = FaultRates(**values)
        draw: Any = drawn_plc_faults if self._mailbox else drawn_faults
        faults: tuple[Any, ...] = draw(seed, link, rates)
        return faults

    def _actions(
        self, value: object, where: str, link: LinkKind, line: int
    ) -> tuple[AnyAction | None, ...]:
        if not isinstance(value, list):
            self._object(where, tr("must be a list in brackets"), line)
            return ()
        return tuple(self._action(where, name, link, line) for name in value)

    def _text(self, value: object, where: str, line: int) -> object:
        if not isinstance(value, str) or len(value) > 200:
            self._object(where, tr("must be a text of at most 200 characters"), line)
        return value

    def _number(self, key: str, value: object, where: str, line: int) -> Any:  # noqa: ANN401 - whole or not
        kind, least, most = _NUMBERS[key]
        allowed = int if kind is int else (int, float)
        if isinstance(value, bool) or not isinstance(value, allowed):
            what = tr("must be a whole number") if kind is int else tr("must be a number")
            self._object(where, what, line)
            return None
        if not least <= value <= most:  # NaN is neither
            self._object(where, at_least(least) if value < least else at_most(most), line)
        return value

    def _object(self, where: str, what: str, line: int) -> None:
        self.problems.append(Problem(f"line {line}, {where}" if line else where, what))

    def _line(self, table: str, number: int, key: str) -> int:
        """Return the line of a key, or of its table, 0 where the form of the file hides it."""
        place, header = 0, re.compile(r"^\s*\[+\s*([A-Za-z_]+)\s*\]+")
        inside, count = table == "", 0
        for line, text in enumerate(self._lines, 1):
            if found := header.match(text):
                count += found[1] == table
                inside = found[1] == table and count == number
                if inside or (not table and found[1] == key):
                    place = place or line
            elif inside and key and re.match(rf"^\s*\"?{re.escape(key)}\"?\s*=", text):
                return line
        return place
