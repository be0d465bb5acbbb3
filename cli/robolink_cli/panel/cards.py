"""What the pages show of a cell beside its job: how it stands, what can be begun, what was done."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from markupsafe import Markup


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
