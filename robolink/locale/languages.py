"""The languages that robolink speaks, and where their sentences come from.

A wheel brings its catalogues compiled (``tools/compile_catalogues.py``). In a clone, and where
robolink is installed in place, a catalogue is compiled again when its source is newer; Babel is
asked for that, so where it is missing what was compiled last is used.
"""

import os
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from robolink.messages import install

if TYPE_CHECKING:
    from gettext import GNUTranslations

ENGLISH: Final = "en"
CHINESE: Final = "zh"

LANGUAGES: Final = (CHINESE, ENGLISH)
"""Names by which a person selects a language."""

FOLDER: Final = os.path.dirname(os.path.abspath(__file__))
"""Folder of the catalogues, ``LANGUAGE/LC_MESSAGES/NAME.po``."""

TERRITORY: Final = {CHINESE: "zh_CN"}
"""Folder name of each language that has a catalogue."""

OURS: Final = "robolink"
CLICK: Final = "click"
"""Names of the two catalogues: our own sentences, and those of click."""

_TRADITIONAL: Final = ("hant", "tw", "hk", "mo", "taiwan", "hong kong", "macao", "traditional")


def language_named(text: str) -> str | None:
    """Return the language meant by a name in any usual form, ``None`` if robolink lacks it.

    Args:
        text: A tag (``zh-Hans``), a POSIX locale (``zh_CN.GBK``) or a Windows name
            (``Chinese_China.936``).
    """
    name = text.partition(".")[0].partition("@")[0].strip().lower().replace("-", "_")
    language, *details = name.split("_")
    if language in ("en", "eng", "english", "c", "posix"):
        return ENGLISH
    if language in ("zh", "zho", "chi") or language.startswith("chinese"):
        # For readers of the other script, English is better than a guess.
        other_script = any(word in part for part in (language, *details) for word in _TRADITIONAL)
        return None if other_script else CHINESE
    return None


def speak(language: str) -> bool:
    """Show every sentence in ``language`` from now on; return whether that is possible.

    Where its catalogue is not there, English stays.

    Args:
        language: One of :data:`LANGUAGES`.
    """
    translate = translator(language)
    install(translate)
    return translate is not None or language == ENGLISH


def translator(language: str) -> Callable[[str], str] | None:
    """Return the translation function, ``None`` for English or without a catalogue."""
    if language not in TERRITORY:
        return None
    ours = catalogue(language, OURS)
    if ours is None:
        return None
    # Help pages show sentences of click beside ours.
    clicks = catalogue(language, CLICK)
    if clicks is not None:
        ours.add_fallback(clicks)
    return ours.gettext


def catalogue(language: str, name: str) -> "GNUTranslations | None":
    """Return a catalogue, compiled anew if its source is newer; ``None`` if there is none.

    One that is damaged, as after a full disk, counts as none: a command then speaks English.

    Args:
        language: One of :data:`LANGUAGES` that has a folder.
        name: :data:`OURS` or :data:`CLICK`.
    """
    import copy
    import gettext
    import io
    import struct

    source = os.path.join(FOLDER, TERRITORY[language], "LC_MESSAGES", f"{name}.po")
    compiled = os.path.splitext(source)[0] + ".mo"
    try:
        if _is_newer(source, compiled):
            return gettext.GNUTranslations(io.BytesIO(_compile(source, compiled)))
    except ImportError:
        pass  # no Babel: the last compiled catalogue is used, without newer sentences
    try:
        # A copy, as gettext itself gives: the caller adds a fallback to it.
        seen = os.stat(compiled)
        return copy.copy(_read(compiled, (seen.st_mtime_ns, seen.st_size)))
    except (OSError, struct.error, UnicodeError, LookupError):
        return None


@lru_cache(maxsize=2 * len(TERRITORY))
def _read(compiled: str, _version: tuple[int, int]) -> "GNUTranslations":
    """Return a compiled catalogue; a process that runs several commands reads each once."""
    import gettext

    with open(compiled, "rb") as file:
        return gettext.GNUTranslations(file)


def _is_newer(source: str, compiled: str) -> bool:
    """Tell whether there is a source and no compiled catalogue that was made since."""
    try:
        written = os.stat(source).st_mtime_ns
    except OSError:
        return False
    try:
        return os.stat(compiled).st_mtime_ns < written
    except OSError:
        return True


def _compile(source: str, compiled: str) -> bytes:
    """Return a catalogue as gettext reads it, and keep it where that is possible.

    Raises:
        ImportError: Babel is not installed.
    """
    import io

    from babel.messages.mofile import write_mo
    from babel.messages.pofile import read_po

    with open(source, "rb") as file:
        read = read_po(file)
    made = io.BytesIO()
    write_mo(made, read)
    # Written whole or not at all: another process may be reading it.
    draft = f"{compiled}.{os.getpid()}"
    try:
        with open(draft, "wb") as file:
            file.write(made.getvalue())
        os.replace(draft, compiled)
    except OSError:
        with suppress(OSError):
            os.remove(draft)
    return made.getvalue()
