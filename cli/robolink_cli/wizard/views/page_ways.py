"""What a page offers in place of a command: where it is shown there is no keyboard.

Sentences name commands, for whoever sits at a terminal. At a wire the jobs of the page stand in
their place, by the names of their buttons; of any other command it is said where to type it.
"""

import re
from collections.abc import Mapping
from typing import Final

from robolink.messages import declared, joined, spoken, tr

TITLES: Final[Mapping[str, str]] = {
    "plan": declared("Carry out the job of a plan"),
    "change": declared("Change a needle or nozzle"),
    "recover": declared("Finish or undo the interrupted job"),
    "release": declared("Allow movement again after a stop."),
    "check": declared("Check the cell"),
    "undo": declared("Undo the last tool change"),
    "station": declared("Find a station again"),
}
"""What the jobs of a page are called, in English, by their names."""

_WORDS: Final[Mapping[str, str]] = {
    "fleet next": "plan",
    "change": "change",
    "recalibrate": "change",
    "recover": "recover",
    "robot release": "release",
    "release": "release",
    "cell check": "check",
    "undo": "undo",
    "cell station learn": "station",
}
"""The jobs, by the words of their commands."""

_CELL: Final = r"""(?: -c (?:"[^"]*"|[^\s"']+))?"""
_ENDS: Final = r"(?=[.,;:\u3002\uff0c\uff1b]|\s*$|\n|, then| \()"
_COMMAND: Final = re.compile(
    rf"""(?P<quote>['"]?)robolink{_CELL} (?P<words>{"|".join(_WORDS)})"""
    rf"""(?P<rest>(?: (?!--|then\b)[\w./\\-]+)?)(?P=quote){_ENDS}"""
)
"""A command that a page has a job for, with nothing but the job's subject behind it."""

_TAKES_NONE: Final = frozenset({"recover", "release", "check", "undo"})
"""Jobs without a subject: with a word behind it, it is another command, or a sentence."""

_OTHER: Final = re.compile(
    rf"robolink{_CELL} (?:recover|resolve|robot|tool|cell|journal|calibrate|change|status|undo|"
    r"check|stop|panel|plc|spel|expert|demo|fleet)\b"
)


def on_a_page(text: str) -> str:
    """Return a text with the jobs of a page in place of the commands that do the same.

    Args:
        text: One or several sentences, in the language that is spoken.
    """
    if "robolink" not in text:
        return text

    def job(found: "re.Match[str]") -> str:
        name, subject = _WORDS[found["words"]], found["rest"].strip()
        if subject and name in _TAKES_NONE:
            return found[0]
        if name == "station" and subject:
            title = tr("Find the station {station} again", station=subject)
        else:
            title = spoken(TITLES[name]).rstrip(".\u3002")
        return tr("'{job}' on this page", job=title)

    said = _COMMAND.sub(job, text)
    if _OTHER.search(said):
        where = tr("Type commands at the panel's computer.")
        ended = said if said.endswith((".", "\u3002")) else f"{said}."
        return joined(" ", (ended, where)) if "\n" not in said else f"{said}\n{where}"
    return said
