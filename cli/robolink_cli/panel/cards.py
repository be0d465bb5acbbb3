"""What the pages show of a cell beside its job: how it stands, what can be begun, what was done."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final
from urllib.parse import urlencode

from markupsafe import Markup

SIGNS: Final = ("bad", "look", "busy", "ok", "unknown")
"""What the page of all cells is looked through by, the most urgent first."""

A_PAGE: Final = 48
"""Cells on one page of the page of all cells."""


@dataclass(frozen=True, slots=True)
class CellChoice:
    """Which cells the page of all cells shows.

    Attributes:
        group: Name of a group; empty for all cells.
        sign: One of :data:`SIGNS`; empty for all.
        page: The number of its page, from 1.
        groups: Whether groups are shown in place of cells.
    """

    group: str = ""
    sign: str = ""
    page: int = 1
    groups: bool = False

    @property
    def query(self) -> str:
        """What stands behind the ``?`` of its address."""
        said = {
            "group": self.group,
            "sign": self.sign,
            "page": "" if self.page == 1 else str(self.page),
            "groups": "1" if self.groups else "",
        }
        return urlencode({name: value for name, value in said.items() if value})

    def link(self, **changed: object) -> str:
        """Return the address of another choice; with the first page, unless that is changed.

        Args:
            changed: The attributes that differ.
        """
        query = replace(self, **{"page": 1, **changed}).query  # type: ignore[arg-type]
        return f"/?{query}" if query else "/"

    @classmethod
    def of(cls, said: Mapping[str, str]) -> "CellChoice":
        """Return what an address asks for; what is none of it counts as nothing.

        Args:
            said: The parameters.
        """
        page, sign = said.get("page", ""), said.get("sign", "")
        return cls(
            said.get("group", "")[:200],
            sign if sign in SIGNS else "",
            int(page) if page.isascii() and page.isdigit() and len(page) < 6 else 1,
            said.get("groups") == "1",
        )


ALL_CELLS: Final = CellChoice()
"""The first page of all cells."""


@dataclass(frozen=True, slots=True)
class GroupCard:
    """A group of cells.

    Attributes:
        name: Its name.
        total: How many cells it has.
        signs: How many of them have each of :data:`SIGNS` that one has.
    """

    name: str
    total: int
    signs: Mapping[str, int] = field(hash=False)


@dataclass(frozen=True, slots=True)
class CellsBar:
    """What stands above and below the cells: how many there are, and the ways to others.

    Attributes:
        choice: What is shown.
        total: How many cells there are of that group.
        signs: How many of them have each of :data:`SIGNS` that one has.
        found: How many are chosen.
        pages: How many pages these are.
        groups: The groups; empty where they are not shown.
        grouped: Whether there are groups.
        plans: Whether there is a page of plans.
    """

    choice: CellChoice
    total: int
    signs: Mapping[str, int] = field(hash=False)
    found: int
    pages: int
    groups: tuple[GroupCard, ...] = ()
    grouped: bool = False
    plans: bool = False

    @property
    def shown(self) -> bool:
        """Whether there is more than one look at the cells."""
        return self.grouped or self.total > A_PAGE or bool(self.choice.query)


@dataclass(frozen=True, slots=True)
class JobOffer:
    """A job that can be begun on a cell, by a press of ``/start``.

    Attributes:
        job: The name that goes with the press.
        text: What it is called.
        details: What is to be read of it.
        values: What else goes with the press.
        why_not: Why it cannot be begun now; empty where it can.
    """

    job: str
    text: str
    details: tuple[str, ...] = ()
    values: Mapping[str, str] = field(default_factory=dict)
    why_not: str = ""


@dataclass(frozen=True, slots=True)
class CellCard:
    """A cell, as it was heard last.

    Attributes:
        name: Its name.
        mark: ``ok``, ``look``, ``bad``, or ``unknown`` where it does not answer.
        word: Its state in a word.
        lines: What else is to be read, the most important first.
        simulated: Whether nothing real moves.
        busy: Whether a job runs.
        seat: Who works on it; empty for nobody.
        jobs: What can be begun.
        read: Whether the controller was read, so that there is an age to be shown.
        said: What the last job left to be read, in full.
    """

    name: str
    mark: str
    word: str
    lines: tuple[str, ...] = ()
    simulated: bool = False
    busy: bool = False
    seat: str = ""
    jobs: tuple[JobOffer, ...] = ()
    read: bool = False
    said: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ChangeRow:
    """A change on record.

    Attributes:
        change: Its id.
        when: Local time.
        who: Who made it.
        what: Tool and needle.
        agree: How well the touches agreed; empty where nothing was measured.
        tested: What the turn test showed; empty without one.
        moved: How far the tip moved.
        mark: ``ok``, ``look`` or ``bad``.
        word: The mark in words.
        report: Whether its report can be opened.
    """

    change: str
    when: str
    who: str
    what: str
    agree: str
    tested: str
    moved: str
    mark: str
    word: str
    report: bool = True


@dataclass(frozen=True, slots=True)
class ChartCard:
    """A control chart.

    Attributes:
        title: What it shows.
        picture: The drawing.
        caption: What is to be read of it.
        unusual: What is unusual in it; empty for nothing.
    """

    title: str
    picture: Markup
    caption: str
    unusual: str = ""
