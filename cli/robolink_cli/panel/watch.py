"""Looks at cells on which no job runs: seldom, and only where somebody wants it.

An EPSON controller serves one client. A panel that polled it would keep others out by chance, so a
look is made when a page of the cell is opened, or every ``watch_s`` of its cell file. It is
``robolink status``: a process of its own that connects, reads, and closes; what that may read while
production runs, docs/monitor-only.md says. Where somebody has the controller, it is not asked: who
has it tells what was seen last.
"""

import asyncio
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Final

from robolink.locale.languages import ENGLISH
from robolink.messages import declared, spoken, tr
from robolink.model import is_simulated_name
from robolink.timing import local_label, wall_label
from robolink_cli.console.language import VARIABLE
from robolink_cli.console.shell_words import state_word
from robolink_cli.panel.cards import CellCard
from robolink_cli.panel.record import Standing
from robolink_cli.panel.words import spoken_language

LEAST_APART_S: Final = 5.0
"""Shortest time in s between two looks at a cell that a page asked for."""

STALE_AFTER_S: Final = 10.0
"""Age in s from which a reading says how the cell was, and no longer how it is."""

NO_ANSWER: Final = declared("The cell did not answer.")

_LONGEST_S: Final = 20.0
"""Longest wait in s for the end of a look."""

AT_ONCE: Final = 2
"""Number of looks at the same time: each is a process."""


@dataclass(frozen=True, slots=True)
class CellLook:
    """What a look showed.

    Attributes:
        at_s: When, monotonic.
        at: When, as a label.
        read: The document of ``robolink status``; empty where it ended in an error.
        failed: Why nothing was read, in English; empty where something was.
        failed_here: The same in the language of the look.
        language: Of the look.
    """

    at_s: float
    at: str
    read: dict[str, Any] = field(default_factory=dict)
    failed: str = ""
    failed_here: str = ""
    language: str = ENGLISH

    @property
    def state(self) -> str:
        """The controller's state; empty where nobody knows it."""
        return str(self.read.get("state") or "")

    @property
    def simulated(self) -> bool | None:
        """Whether the controller said that nothing real moves; ``None`` where it did not say.

        A look at an EPSON controller reads no serial number: who it is, only a job asks.
        """
        name, said = str(self.read.get("controller", "")), self.read.get("simulated")
        if is_simulated_name(name) or said is True:
            return True
        return False if said is False or (name and "://" not in name) else None

    def why(self) -> str:
        """Return why nothing was read, in the language that is spoken."""
        here = self.failed_here if self.language == spoken_language() else ""
        return here or spoken(self.failed)

    @property
    def taken_s(self) -> float:
        """When the controller was read, monotonic: by another process it was read before."""
        age = self.read.get("age_s")
        return self.at_s - (float(age) if isinstance(age, (int, float)) else 0.0)


class CellWatch:
    """Looks at one cell.

    Args:
        cell: Its name.
        url: Its controller.
        every_s: How often it is looked at; ``None`` for only when a page is opened.
        changed: Called when there is something new to show.
        slots: Taken for a look, of all cells together.

    Attributes:
        look: What was seen last; ``None`` before the first look.
        looking: Whether a look is under way.
    """

    def __init__(
        self,
        cell: str,
        url: str,
        every_s: float | None,
        changed: Callable[[], None],
        slots: asyncio.Semaphore,
    ) -> None:
        self.cell, self.url, self.every_s = cell, url, every_s
        self._slots = slots
        self._changed = changed
        self.look: CellLook | None = None
        self.looking = False

    def is_due(self, now_s: float, *, wanted: bool) -> bool:
        """Return whether to look now.

        Args:
            now_s: The time, monotonic.
            wanted: Whether a page of the cell was just opened.
        """
        if self.looking:
            return False
        if self.look is None:
            return wanted or self.every_s is not None
        apart_s = LEAST_APART_S if wanted else self.every_s
        return apart_s is not None and now_s - self.look.at_s >= apart_s

    async def take(self, language: str = ENGLISH) -> None:
        """Look.

        Args:
            language: In which what is read is told.
        """
        if self.looking:
            return
        self.looking = True
        try:
            async with self._slots:
                self.look = await _looked(self.cell, language)
        finally:
            self.looking = False
        self._changed()


async def _looked(cell: str, language: str) -> CellLook:
    try:
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            *("-m", "robolink_cli", "--json", "-c", cell, "status"),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.DEVNULL,
            env={**os.environ, VARIABLE: language, "PYTHONIOENCODING": "utf-8"},
            start_new_session=os.name != "nt",
        )
        try:
            out, _ = await asyncio.wait_for(process.communicate(), _LONGEST_S)
        except TimeoutError:
            process.kill()
            await process.wait()
            return CellLook(time.monotonic(), wall_label(), failed=NO_ANSWER)
        said = json.loads(out)
    except (OSError, ValueError) as error:
        return CellLook(time.monotonic(), wall_label(), failed=str(error) or type(error).__name__)
    now_s, at = time.monotonic(), wall_label()
    if "error" in said:
        ended = said["error"]
        here = str(ended.get("what", ""))
        failed = str(ended.get("english") or here) or NO_ANSWER
        return CellLook(now_s, at, failed=failed, failed_here=here or NO_ANSWER, language=language)
    return CellLook(now_s, at, read=said, language=language)


def mark_of(watch: CellWatch, standing: Standing, now_s: float) -> str:
    """Return the mark of a cell on which no job runs: ``ok``, ``look``, ``bad`` or ``unknown``.

    Args:
        watch: What was seen of it.
        standing: What is on record of it.
        now_s: The time, monotonic.
    """
    look = watch.look
    if look is None or look.failed or now_s - look.taken_s >= STALE_AFTER_S:
        return "unknown"
    mark = _mark(look)
    # What is open counts however the controller stands.
    return "look" if mark == "ok" and (standing.is_open or standing.unusual) else mark


def card_of(
    watch: CellWatch,
    standing: Standing,
    now_s: float,
    *,
    simulated: bool,
    said: tuple[str, ...] = (),
) -> CellCard:
    """Return the card of a cell on which no job runs, in the language that is spoken.

    Args:
        watch: What was seen of it.
        standing: What is on record of it.
        now_s: The time, monotonic.
        simulated: Whether nothing real moves.
        said: What the last job left to be read.
    """
    look = watch.look
    card = CellCard(watch.cell, "unknown", tr("not looked at"), simulated=simulated)
    if look is None:
        told = tr("Looking ...") if watch.looking else tr("Open the cell to look at it.")
        card = replace(card, lines=(told,))
    elif look.failed:
        card = replace(card, word=tr("no answer"), lines=(look.why(), _when(look)))
    else:
        card = replace(
            card,
            word=state_word(look.state) if look.state else tr("not read"),
            lines=_read(look, now_s),
            read=True,
            simulated=simulated or look.simulated is True,
        )
    card = replace(card, mark=mark_of(watch, standing, now_s))
    lines = standing.lines()
    # Of what the last job left the first line tells how it ended; the rest stands below.
    head, _, _ = "\n".join(said).partition("\n")
    shown = (*lines, *((head,) if head else ()), *card.lines, *standing.past())
    return replace(card, lines=shown, said=said)


def _mark(look: CellLook) -> str:
    read = look.read
    if any(read.get(flag) for flag in ("emergency_stop", "guard_open", "fault", "serious_fault")):
        return "bad"
    if read.get("held_by") or read.get("running") or read.get("warning") or look.state != "ready":
        return "look"
    return "ok"


def _read(look: CellLook, now_s: float) -> tuple[str, ...]:
    read, lines = look.read, list[str]()
    if read.get("held_by"):
        lines.append(tr("In use: {who}.", who=read["held_by"]))
    if isinstance(read.get("selected_tool"), int):
        lines.append(tr("tool {n} selected", n=read["selected_tool"]))
    if read.get("text"):
        lines.append(str(read["text"]))
    if now_s - look.taken_s >= STALE_AFTER_S:
        lines.append(tr("This is how it was at {time}.", time=_clock(look)))
    return tuple(lines)


def _when(look: CellLook) -> str:
    return tr("Last look: {time}.", time=_clock(look))


def _clock(look: CellLook) -> str:
    return local_label(look.at)
