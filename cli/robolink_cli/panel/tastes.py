"""How each tablet wants its pages: its language, bright or dark; kept in the state folder."""

import json
from collections.abc import Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final

from robolink.files.durable import make_folder, state_folder, write_whole
from robolink.locale.languages import ENGLISH, LANGUAGES
from robolink_cli.panel.words import speaking_in

_MOST: Final = 256
"""Number of tablets that are remembered."""


@dataclass(frozen=True, slots=True)
class Taste:
    """How one tablet wants its pages.

    Attributes:
        language: One of :data:`robolink.locale.languages.LANGUAGES`.
        dark: Whether they are dark.
    """

    language: str = ENGLISH
    dark: bool = False


class Tastes:
    """How all tablets want their pages.

    Args:
        language: Of a tablet that has not chosen one.
        path: Where it is kept; by default in the state folder.
    """

    def __init__(self, language: str = ENGLISH, path: Path | None = None) -> None:
        self._usual = Taste(language)
        self._path = path or state_folder("panel") / "pages.json"
        self._known = _kept(self._path)

    def of(self, tablet: str) -> Taste:
        """Return how a tablet wants its pages.

        Args:
            tablet: Its id; empty where it has none.
        """
        return self._known.get(tablet, self._usual)

    def set(self, tablet: str, language: str | None, dark: bool | None) -> None:
        """Note what a tablet wants; ``None`` leaves it as it was.

        That it cannot be kept for the next start of the panel is no reason to refuse it.
        """
        if not tablet:
            return
        taste = self.of(tablet)
        taste = replace(
            taste,
            language=taste.language if language is None else language,
            dark=taste.dark if dark is None else dark,
        )
        self._known.pop(tablet, None)
        self._known[tablet] = taste
        while len(self._known) > _MOST:
            del self._known[next(iter(self._known))]
        kept = {name: asdict(one) for name, one in self._known.items()}
        with suppress(OSError):
            make_folder(self._path.parent)
            write_whole(self._path, json.dumps(kept).encode())

    def speaking(self, tablet: str) -> AbstractContextManager[None]:
        """Speak the language of a tablet, for a block."""
        return speaking_in(self.of(tablet).language)


def _kept(path: Path) -> dict[str, Taste]:
    try:
        kept = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return {}
    found = dict[str, Taste]()
    for tablet, one in kept.items() if isinstance(kept, dict) else ():
        if isinstance(one, Mapping) and one.get("language") in LANGUAGES:
            found[tablet] = Taste(str(one["language"]), one.get("dark") is True)
    return found
