"""Every sentence that a person reads passes through this module.

Every sentence shown to a person is written as ``tr("...")`` where it is used and
collected into ``robolink/locale/robolink.pot`` by ``make messages``; a test fails when
that catalogue is stale. A language is installed once per process with
:func:`install`; without one the English source sentence is shown. Which languages there
are says ``robolink/locale/languages.py``.

What is made when a module is imported is made before a language is known: it is
``declared("...")``, and goes through :func:`spoken` when it is shown.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Final

__all__ = [
    "Translated",
    "declared",
    "in_english",
    "install",
    "joined",
    "known_names",
    "listed",
    "plain",
    "spoken",
    "tr",
]

_translate: Callable[[str], str] | None = None

_WIDE_STOPS = ("\u3002", "\uff01", "\uff1f")


class Translated(str):
    """A sentence in the language of the process that knows its English original.

    Records are read by other people than the one at the screen, and compared with each other:
    they are kept in English (:func:`in_english`).
    """

    __slots__ = ("english",)

    english: str

    def __new__(cls, text: str, english: str) -> "Translated":
        """Return ``text``, which says what ``english`` says."""
        made = super().__new__(cls, text)
        made.english = english
        return made

    def __reduce__(self) -> tuple[type["Translated"], tuple[str, str]]:
        """Return what a copy is made from."""
        return Translated, (str.__str__(self), self.english)


def install(translate: Callable[[str], str] | None) -> None:
    """Use ``translate`` for every sentence from now on (``gettext``'s signature).

    ``None`` goes back to the English source sentences.
    """
    global _translate  # noqa: PLW0603 - one language per process, as with gettext itself
    _translate = translate


def tr(sentence: str, /, **values: object) -> str:
    """Translate ``sentence`` and fill its ``{placeholders}`` from ``values``."""
    if _translate is None:
        return sentence.format(**values) if values else sentence
    return _translated(_translate, sentence, values)


def declared(sentence: str, /) -> str:
    """Return ``sentence`` unchanged, to be collected; :func:`spoken` translates it."""
    return sentence


def spoken(sentence: str, /) -> str:
    """Return a declared sentence in the language of the process.

    What no catalogue knows, such as the declaration of another package, comes back as it is.
    """
    return sentence if _translate is None else _translated(_translate, sentence, {})


def joined(between: str, sentences: Iterable[str]) -> str:
    """Return whole sentences joined in order; like each of them, the result keeps its English.

    No blank stands behind a Chinese full stop, which is wide by itself.
    """
    parts = list(sentences)
    text = "".join(parts[:1])
    for part in parts[1:]:
        text += part if between == " " and text.endswith(_WIDE_STOPS) else f"{between}{part}"
    english = between.join(in_english(part) for part in parts)
    return text if text == english else Translated(text, english)


LIST_LINE: Final = "    "
"""Begins each line of a list."""


def listed(sentence: str, lines: Iterable[str]) -> str:
    """Return a sentence with a list below it, a line each; both keep their English.

    Findings, causes, commands and long names are listed, so that the sentence stays short.

    Example:
        >>> from robolink.messages import listed
        >>> print(listed("needle.toml has 2 errors:", ["line 1: x is missing", "line 2: y is 0"]))
        needle.toml has 2 errors:
            line 1: x is missing
            line 2: y is 0
    """
    return joined(f"\n{LIST_LINE}", (sentence, *lines))


def first_sentence(text: str) -> str:
    """Return the first sentence of a text on one line; like the text, it keeps its English."""
    cut, english = _first(text), _first(in_english(text))
    return cut if cut == english else Translated(cut, english)


def _first(text: str) -> str:
    flat = " ".join(text.split())
    ends = [at + 1 for stop in (". ", "? ", "! ", *_WIDE_STOPS) if (at := flat.find(stop)) >= 0]
    return flat[: min(ends)] if ends else flat


def without(sentence: str, text: str) -> str:
    """Return a text less the sentence that it begins with; like the text, it keeps its English."""
    rest = text.removeprefix(sentence).lstrip()
    english = in_english(text).removeprefix(in_english(sentence)).lstrip()
    return rest if rest == english else Translated(rest, english)


def in_english(text: str) -> str:
    """Return the English of a text that a person was shown, for a record."""
    return text.english if isinstance(text, Translated) else text


_MOST: Final = 100
"""Largest number of characters of a list of names that is shown whole."""

_SHOWN: Final = 50
"""Number of characters shown of a longer list: 200 names help nobody."""


def known_names(names: Iterable[object], typed: object = "") -> str:
    """Return the sentence that says which names there are.

    Args:
        names: All that could be given.
        typed: What was given instead; of many names, those that look like it are told.

    Example:
        >>> from robolink.messages import known_names
        >>> known_names(["line3", "line4"], "north")
        'Choose one of these: line3, line4.'
        >>> known_names([f"option_{n}" for n in range(200)], "opton_17")
        'Did you mean option_17, option_197?'
    """
    from difflib import get_close_matches  # imported here, because a stop does not need it

    texts = [str(name) for name in names]
    if not texts:
        return tr("There are none here.")
    listed = ", ".join(texts)
    if len(listed) <= _MOST:
        return tr("Choose one of these: {names}.", names=listed)
    folded = {text.casefold(): text for text in texts}
    wanted = str(typed).casefold()
    near = get_close_matches(wanted, folded, n=2, cutoff=0.7)
    near = near or [one for one in folded if wanted and wanted in one][:2]
    if near:
        return tr("Did you mean {names}?", names=", ".join(folded[one] for one in near))
    shown = listed[:_SHOWN].rpartition(", ")[0]
    return tr("Choose one of {count}: {names} ...", count=len(texts), names=shown)


def plain(value: object) -> object:
    """Return plain values, mappings and lists, with every sentence in them in English."""
    kind = type(value)
    if kind in _AS_THEY_ARE:  # most values of a record, and far faster than the rest
        return value
    match value:
        case str():
            return in_english(value)
        case list() | tuple():
            if kind not in (list, tuple):  # a class of its own, such as a named tuple
                return value
            return kind([one if type(one) in _AS_THEY_ARE else plain(one) for one in value])
        case dict() | Mapping():
            return {
                key: one if type(one) in _AS_THEY_ARE else plain(one) for key, one in value.items()
            }
        case _:
            return value


_AS_THEY_ARE: Final = frozenset({str, float, int, bool, type(None)})
"""Types of values that do not depend on the language; a sentence has its own type."""


def _translated(
    translate: Callable[[str], str], sentence: str, values: Mapping[str, object]
) -> str:
    if not sentence:
        return ""  # the name under which gettext keeps the header of a catalogue
    text = translate(sentence)
    if not values:
        return text if text == sentence else Translated(text, sentence)
    english = sentence.format(**{name: plain(value) for name, value in values.items()})
    try:
        filled = text.format(**values)
    except (LookupError, ValueError, AttributeError, TypeError):
        return english  # a faulty translation must not hide the message
    return filled if filled == english else Translated(filled, english)
