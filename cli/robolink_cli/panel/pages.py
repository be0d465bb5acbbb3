"""Pages and parts of pages: records go in, escaped HTML comes out.

Nothing here decides. What can be pressed says the record; who may press, the watcher. The words of
the frame are in the language of the tablet, those of a job in the language of the job.
"""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined

from robolink.locale.languages import CHINESE, ENGLISH, LANGUAGES, translator
from robolink.report import look_markup
from robolink.report._markup import shown
from robolink_cli.panel import drawings
from robolink_cli.panel.camera import OLD_S, CameraLook
from robolink_cli.panel.cards import CellCard, CellsBar
from robolink_cli.wizard.views.records import (
    Action,
    CheckView,
    ChoiceView,
    EndView,
    FitView,
    MovingView,
    QuestionView,
    TouchView,
    ValuesView,
    View,
    WaitView,
    Weight,
)

NOBODY: Final = ""
HERE: Final = "here"
"""The seat of a cell is this tablet's."""

ONLOOKER: Final = "onlooker"

PAGES: Final = ("cell", "overview", "history", "login", "pairing", "plans", "plan", "decision")
"""Whole pages."""

_LIVE: Final = ("cell", "overview", "plans", "plan")
"""Those that follow what happens, by a stream."""

HELD_UP_TO_MM: Final = 0.5
"""Longest step, mm or degrees, that a held key repeats; longer ones are single taps."""

_FILES: Final = ("panel.css", "panel.js")

_SCREENS: Final[Mapping[type[object], str]] = {
    ChoiceView: "choice",
    CheckView: "check",
    MovingView: "moving",
    WaitView: "wait",
    TouchView: "touch",
    FitView: "fit",
    ValuesView: "values",
    QuestionView: "question",
    EndView: "end",
}
_BESIDE_CAMERA: Final = frozenset({"choice", "moving", "wait", "question", "end", "idle"})
"""Screens beside which a camera's picture is shown; on the others all room is needed."""

_PLACES: Final = {
    "up": "\u25b2",
    "down": "\u25bc",
    "left": "\u25c0",
    "right": "\u25b6",
    "above": "\u2191",
    "below": "\u2193",
    "turn+": "\u27f2",
    "turn-": "\u27f3",
}
_MARKS: Final = {
    "ok": "\u25a0",
    "look": "\u25b2",
    "you": "\u25b2",
    "to do": "\u25b2",
    "bad": "\u2715",
}
_UNKNOWN: Final = "?"
_ORDER: Final = (Weight.LEAVES, Weight.PLAIN, Weight.MAIN)


@dataclass(frozen=True, slots=True)
class Watcher:
    """Who looks at a page.

    Attributes:
        language: That of the tablet.
        dark: Whether its pages are dark.
        seat: Whose the cell's seat is: :data:`HERE`, the name of another, or empty for nobody.
        who: Who is signed in; empty for nobody.
        role: ``onlooker``, ``operator`` or ``engineer``; empty where nobody is signed in.
        paired: Whether a STOP from this tablet is carried out.
        young: Whether the PIN was given so recently that what moves or writes may be pressed.
    """

    language: str = ENGLISH
    dark: bool = False
    seat: str = NOBODY
    who: str = ""
    role: str = ""
    paired: bool = True
    young: bool = True

    @property
    def presses(self) -> bool:
        """Whether what is pressed here is heard."""
        return self.seat == HERE and self.may_take

    @property
    def may_take(self) -> bool:
        """Whether this person may have the seat."""
        return self.role not in ("", ONLOOKER)


@dataclass(frozen=True, slots=True)
class Parts:
    """The parts of a page that follow a cell.

    Attributes:
        screen: Name of the screen.
        head, main, foot: HTML.
    """

    screen: str
    head: str
    main: str
    foot: str

    def named(self) -> dict[str, str]:
        """Return the parts by the ids of their places."""
        return {"head": self.head, "main": self.main, "foot": self.foot}


class Pages:
    """Makes pages; it keeps nothing of a cell or a tablet."""

    def __init__(self) -> None:
        self._environment = _environment()
        self.version = _version()

    def screen(self, view: View, watcher: Watcher, *, camera: CameraLook | None = None) -> Parts:
        """Return the parts that show a view.

        Args:
            view: What the job shows.
            watcher: Who looks.
            camera: What a camera of the cell saw last, ``None`` for nothing.
        """
        name = _SCREENS[type(view.body)]
        cell = view.head.cell
        parts = self._parts(name, watcher, view=view, body=view.body, cell=cell)
        return self._with_camera(parts, watcher, cell, camera)

    def idle(self, card: CellCard, watcher: Watcher, *, camera: CameraLook | None = None) -> Parts:
        """Return the parts that show a cell on which no job runs."""
        parts = self._parts("idle", watcher, card=card, cell=card.name)
        return self._with_camera(parts, watcher, card.name, camera)

    def _with_camera(
        self, parts: Parts, watcher: Watcher, cell: str, camera: CameraLook | None
    ) -> Parts:
        """Return the parts with the camera's picture beside them, on screens that have room."""
        if camera is None or parts.screen not in _BESIDE_CAMERA:
            return parts
        figure = self._filled("camera.html", watcher, cell=cell, camera=camera)
        main = f'<div class="beside"><div class="own">{parts.main}</div>{figure}</div>'
        return replace(parts, main=main)

    def overview(
        self, cells: Sequence[CellCard], watcher: Watcher, bar: CellsBar | None = None
    ) -> Parts:
        """Return the parts that show all cells.

        Args:
            cells: The cells.
            watcher: Who looks.
            bar: What stands above and below them; ``None`` for nothing.
        """
        return self._parts("overview", watcher, cells=cells, bar=bar, cell="")

    def of_plans(self, kind: str, sight: object, watcher: Watcher) -> Parts:
        """Return the parts that show plans.

        Args:
            kind: ``plans`` or ``plan``.
            sight: What they show: a record of :mod:`robolink_cli.panel.plant.plan_cards`.
            watcher: Who looks.
        """
        return self._parts(kind, watcher, sight=sight, cell="")

    def page(self, kind: str, watcher: Watcher, **data: Any) -> str:  # noqa: ANN401 - of the page
        """Return a whole page.

        Args:
            kind: One of :data:`PAGES`.
            watcher: Who looks.
            data: For each the ``token`` of the session; ``cell``, and for it ``parts``
                (:class:`Parts`) and ``number``; ``overview``: ``cells``
                (:class:`~robolink_cli.panel.cards.CellCard`); ``history``: ``cell``,
                ``changes``, ``charts`` and ``simulated``; ``login`` and ``pairing``: ``names``,
                and ``onward``, the page that follows; ``plans`` and ``plan``: ``parts``;
                ``decision``: ``sight``, ``resumes`` and ``onward``. ``query`` is what its stream
                is asked for besides the cell.

        Raises:
            KeyError: There is no such kind.
        """
        if kind not in PAGES:
            raise KeyError(kind)
        given: dict[str, Any] = {
            "token": "",
            "cell": "",
            "number": 0,
            "onward": "/",
            "names": (),
            "parts": None,
            "simulated": False,
            "query": "",
        }
        given |= data
        given["onward"] = _inside(given["onward"])
        if kind == "overview" and given["parts"] is None:
            given["parts"] = self.overview(given["cells"], watcher)
        live = kind in _LIVE
        if not live:
            parts = self._parts(kind, watcher, **given)
            given["parts"] = parts
        elif given["parts"] is None:
            given["parts"] = Parts("", "", "", "")
        return self._filled("frame.html", watcher, kind=kind, live=live, **given)

    def _parts(self, name: str, watcher: Watcher, **values: Any) -> Parts:  # noqa: ANN401
        template = self._environment.get_template(f"{name}.html")
        known = self._values(watcher, values)
        known["m"] = self._environment.get_template("macros.html").make_module(known)

        def block(part: str) -> str:
            return "".join(template.blocks[part](template.new_context(known))).strip()

        return Parts(name, block("head"), block("main"), block("foot"))

    def _filled(self, name: str, watcher: Watcher, **values: Any) -> str:  # noqa: ANN401
        known = self._values(watcher, values)
        known["m"] = self._environment.get_template("macros.html").make_module(known)
        return self._environment.get_template(name).render(known)

    def _values(self, watcher: Watcher, values: Mapping[str, Any]) -> dict[str, Any]:
        return {
            "tr": _words(watcher.language),
            "watcher": watcher,
            "version": self.version,
            "other": ENGLISH if watcher.language == CHINESE else CHINESE,
            **values,
        }


def _inside(onward: str) -> str:
    """Return a page of this panel; the first one where that is none."""
    inside = onward.startswith("/") and onward[1:2] not in ("/", "\\") and onward.isprintable()
    return onward if inside else "/"


def _words(language: str) -> Callable[..., str]:
    """Return what translates the words of the frame.

    A panel speaks with several tablets at once, so the language of the process does not count.
    """
    translate = _translator(language)

    def tr(sentence: str, /, **values: object) -> str:
        text = sentence if translate is None else translate(sentence)
        return text.format(**values) if values else text

    return tr


_translator = cache(translator)


@cache  # compiled templates are kept in it
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("robolink_cli.panel"),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals |= {
        "arm": drawings.arm_drawing,
        "fit_picture": drawings.fit_drawing,
        "turn_picture": drawings.turn_drawing,
        "before_after": drawings.before_after_drawing,
        "look_picture": look_markup,
        "old_s": OLD_S,
        "in_order": _in_order,
        "label_of": _label_of,
        "body_of": _body_of,
        "place_sign": lambda place: _PLACES.get(place, ""),
        "mark_sign": lambda mark: _MARKS.get(mark, _UNKNOWN),
        "is_held": lambda size: size <= HELD_UP_TO_MM,
    }
    environment.filters["step"] = lambda size: f"{size:g}"
    return environment


def _in_order(actions: Sequence[Action]) -> list[Action]:
    """Return actions from the left to the right: what leaves is far from the main one."""
    return sorted(actions, key=lambda action: _ORDER.index(action.weight))


def _label_of(action: Action, tr: Callable[..., str]) -> str:
    """Return what a button is called.

    A terminal calls the key that ends the job STOP. On a page that is the name of one button.
    """
    if action.name == "leave" and action.label in _stops():
        return tr("End the job")
    return action.label


@cache
def _stops() -> frozenset[str]:
    sentences = ("STOP", "STOP, leave")
    return frozenset(_words(one)(said) for one in LANGUAGES for said in sentences)


def _body_of(values: Mapping[str, object]) -> str:
    """Return what goes with a post."""
    return json.dumps(values, ensure_ascii=False, sort_keys=True)


def _version() -> str:
    """Return what changes when a file of the pages does: a tablet loads it anew then."""
    folder = files("robolink_cli.panel").joinpath("static")
    content = b"".join(folder.joinpath(name).read_bytes() for name in _FILES)
    return hashlib.sha256(content).hexdigest()[:12]
