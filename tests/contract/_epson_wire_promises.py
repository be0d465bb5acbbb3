"""What each movement on an EPSON controller's wire must be proved by, read from the wire itself."""

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final

from robolink_simulators.epson.device import EpsonSimulator

from robolink.model import Controller
from robolink.timing import NS_PER_S

Line = tuple[int, str, str]
"""Time in ns, ``>`` for a request or ``<`` for an answer, and the text."""

LOOK = ("Tool", "Motor", "Power", "Speed(1)", "SpeedS(1)")
"""What has to be read before each movement."""

ACCELERATION = ("AccelS(1)", "AccelS(2)")
"""What has to be read besides, where the cell states an acceleration."""

WATCH_S = 0.5
"""Longest time between two looks at the flags while the robot moves."""

_STATEMENT = re.compile(r'\$Execute,"(.*)"')
_TEXT = re.compile(r'#Execute,"(.*?)(?:\\r\\n|\s)*"', re.DOTALL)
_MOVEMENT = re.compile(r"(Move|Go) ")
_SETTING = re.compile(r"(Tool \d+|Power (?:Low|High)|(?:SpeedS?|AccelS) [\d., ]+)$")
_SETS_BACK = re.compile(r"\$(Abort|Reset|SetMotorsOn)\b")
_SLOW = ("Power Low", "Speed ", "SpeedS ")
_STATED = "AccelS "


@dataclass
class Exchange:
    """A request and its answer.

    Attributes:
        asked_ns: When it was sent.
        request: What was asked; of Execute the statement.
        answered_ns: When its answer was.
        answer: What came; of a printing statement its text.
        meanwhile: What was asked before its answer came.
    """

    asked_ns: int
    request: str
    answered_ns: int = 0
    answer: str = ""
    meanwhile: list["Exchange"] = field(default_factory=list)


def sent(simulator: EpsonSimulator, begun: int = 0) -> list[str]:
    """Return the requests that a simulator has got, from an entry of its log on."""
    return [text for _, way, text in list(simulator.log)[begun:] if way == ">"]


def settings_in(requests: Iterable[str]) -> list[str]:
    """Return the statements that set power, speed or acceleration."""
    words = ("Power", "Speed", "Accel")
    return [text[10:-1] for text in requests if text[10:].startswith(words)]


def _stop(controller: Controller) -> None:
    controller.stop()
    controller.release_stop()


SETS_BACK: Final[Mapping[str, Callable[[Controller], None]]] = {
    "stop": _stop,
    "reset": lambda controller: controller.reset_fault(),
    "motors": lambda controller: controller.motors(True),
}
"""What sets power, speed and acceleration back on a controller, or may."""


def movements(log: Iterable[Line]) -> int:
    """Return how many movements were sent."""
    return sum(bool(_MOVEMENT.match(one.request)) for one in exchanges(log))


def exchanges(log: Iterable[Line]) -> list[Exchange]:
    """Pair what crossed the wire; what is asked during a movement stands within it."""
    passed: list[Exchange] = []
    running: Exchange | None = None
    open_one: Exchange | None = None
    for at_ns, direction, text in log:
        if direction == ">":
            statement = _STATEMENT.match(text)
            open_one = Exchange(at_ns, statement[1] if statement else text)
            if running is not None:
                running.meanwhile.append(open_one)
            else:
                passed.append(open_one)
            if statement and _MOVEMENT.match(statement[1]):
                running, open_one = open_one, None
        else:
            is_end = text[1:].startswith("Execute") and running is not None
            ended = running if is_end else open_one
            assert ended is not None, text
            told = _TEXT.match(text)
            ended.answered_ns, ended.answer = at_ns, told[1] if told else text
            if is_end:
                running = None
    return passed


@dataclass
class _Known:
    """What was read and set since the last change; of what was not, nothing is known."""

    read: dict[str, str] = field(default_factory=dict)
    unset: set[str] = field(default_factory=set)
    selected: str = ""
    unseen: str = ""


@dataclass(frozen=True)
class Speeds:
    """The speeds that a recipe wants.

    Attributes:
        percent: Of joint movements.
        mm_s: Of straight movements: of its own, and of its searches.
        mm_s2: The highest acceleration of straight movements; 0 where the cell states none.
    """

    percent: int
    mm_s: Collection[float]
    mm_s2: float = 0.0


def broken_promises(log: Sequence[Line], speeds: Speeds) -> list[str]:
    """Return what each movement was sent without, one line each.

    Before a movement all of :data:`LOOK` was read, after the last movement and the last setting:
    the tool is the one that was selected last, the motors are on, power is low, the speed is as
    wanted, and the acceleration no higher. That it was answered shows that Execute was available.
    After a request that puts power and speed back they were set anew, whatever is read. While it
    moves, the flags are looked at; after it, the position is read before the next one begins.
    """
    known, broken = _Known(), list[str]()
    for one in exchanges(log):
        what = one.request
        if _SETS_BACK.match(what):
            slow = {*_SLOW, _STATED} if speeds.mm_s2 else set(_SLOW)
            known = replace(known, read={}, unset=slow)
        elif _SETTING.match(what):
            known.read.clear()
            known.unset -= {name for name in (*_SLOW, _STATED) if what.startswith(name)}
            if what.startswith("Tool "):
                known.selected = what.removeprefix("Tool ")
        elif what.startswith("Print "):
            if any(name in what for name in ("RealPos", "FindPos")):
                known.unseen = ""
            known.read |= _told(one)
        elif _MOVEMENT.match(what):
            lacks = [*_missing(known, what, speeds), *_unwatched(one)]
            broken += [f"{what}: {why}" for why in lacks]
            known.read.clear()
            known.unseen = what
    return broken


def _told(one: Exchange) -> dict[str, str]:
    names = one.request.removeprefix("Print ").split(", ")
    values = re.split(r"[\s,;]+", one.answer.partition("X:")[0].strip())
    return dict(zip(names, values, strict=False))


def _missing(known: _Known, movement: str, speeds: Speeds) -> Iterator[str]:
    if known.unseen:
        yield f"the end of {known.unseen} was not looked at"
    if known.unset:
        yield "power and speed were not set anew"
    looks = (*LOOK, *(ACCELERATION if speeds.mm_s2 else ()))
    unread = [name for name in looks if name not in known.read]
    if unread:
        yield f"not read: {', '.join(unread)}"
        return
    tool, motor, power, percent, straight = (known.read[name] for name in LOOK)
    if known.selected and tool != known.selected:
        yield f"tool {tool} was read, {known.selected} was selected"
    if motor != "1":
        yield "the motors are off"
    if power != "0":
        yield "power is high"
    if movement.startswith("Go ") and int(percent) != speeds.percent:
        yield f"speed {percent} %"
    if movement.startswith("Move ") and float(straight) not in speeds.mm_s:
        yield f"speed {straight} mm/s"
    if speeds.mm_s2 and movement.startswith("Move "):
        hardest = max(float(known.read[name]) for name in ACCELERATION)
        if hardest > speeds.mm_s2:
            yield f"acceleration {hardest:g} mm/s2"


def _unwatched(movement: Exchange) -> Iterator[str]:
    looks = [one.asked_ns for one in movement.meanwhile if one.request == "$GetStatus"]
    for begin_ns, end_ns in pairwise((movement.asked_ns, *looks, movement.answered_ns)):
        if end_ns - begin_ns > WATCH_S * NS_PER_S:
            yield f"nobody looked for {(end_ns - begin_ns) / NS_PER_S:.2f} s"
