"""The language of this command, and whether the console can show it.

``--lang``, ROBOLINK_LANG, ``language`` in the cell file or the user's, what the system is set to;
what names no language that we have is English (docs/reference/languages.md 1). Nothing of it is
looked at before the first sentence is made, so a stop has sent its frame by then.
"""

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Final

from robolink.locale.languages import (
    CHINESE,
    CLICK,
    ENGLISH,
    FOLDER,
    TERRITORY,
    language_named,
    translator,
)
from robolink.messages import install, spoken, tr
from robolink_cli.console.person import Person, person_here

OPTION: Final = "--lang"
VARIABLE: Final = "ROBOLINK_LANG"

_FOR_MACHINES: Final = ("--json", "--jsonl")
"""Options whose output programs read: it is always in English."""

_SYSTEM: Final = ("LC_ALL", "LC_MESSAGES", "LANG")
_RATHER: Final = "LANGUAGE"
_BARE: Final = ("", "C", "POSIX")
_KEY: Final = "language"
_SAMPLE: Final = {"zh": "\u673a\u5668\u4eba"}


_now: Final[list[str]] = []
"""Language of the current command line, if it is not English."""


def language_now() -> str:
    """Return the language of the present command line."""
    spoken(" ")  # the first text, whatever it is, determines the language
    return _now[-1] if _now else ENGLISH


_listening: Final[list["_Listener"]] = []
"""The listener of the current command line."""


def other_language() -> str:
    """Return the language that a person may switch to; empty if the console shows no other."""
    other = CHINESE if language_now() == ENGLISH else ENGLISH
    return other if other == ENGLISH or _unshown_here(other) is None else ""


def speak_from_now(language: str) -> None:
    """Use a language for the rest of this command line; if that is impossible, say why.

    Args:
        language: One of :data:`robolink.locale.languages.LANGUAGES`.
    """
    if _listening:
        _listening[-1].change_to(language)


@contextmanager
def speaking_for(arguments: Sequence[str]) -> Iterator[None]:
    """Use the language of one command line, for the block.

    Args:
        arguments: The command line without the program's name; it may be wrong.
    """
    listener = _Listener(arguments)
    install(listener)
    _listening.append(listener)
    try:
        yield
    finally:
        _listening.remove(listener)
        install(None)
        listener.end()


class _Listener:
    """Stands for the translation until the first sentence asks for it."""

    def __init__(self, arguments: Sequence[str]) -> None:
        self._arguments = arguments
        self._before: str | None = None
        self._of_click = ""

    def __call__(self, sentence: str) -> str:
        """Find the language, install it, and translate the first sentence."""
        install(None)
        translate = self._find()
        install(translate)
        return sentence if translate is None else translate(sentence)

    def _find(self) -> Callable[[str], str] | None:
        return self._begin(chosen_language(self._arguments, os.environ))

    def change_to(self, language: str) -> None:
        """Switch to another language."""
        self.end()
        install(None)
        install(self._begin(language))

    def _begin(self, language: str) -> Callable[[str], str] | None:
        if language == ENGLISH or not _shown_here(language):
            return None
        translate = translator(language)
        if translate is None:
            _remark(tr("The Chinese sentences are not compiled here. Run: make messages"))
        else:
            self._let_click_speak(language)
            _now.append(language)
        return translate

    def _let_click_speak(self, language: str) -> None:
        """Translate click's own sentences, for which it asks gettext."""
        import gettext

        self._before = os.environ.get("LANGUAGE", "")
        self._of_click = gettext.textdomain()
        os.environ["LANGUAGE"] = TERRITORY[language]
        gettext.bindtextdomain(CLICK, FOLDER)
        gettext.textdomain(CLICK)

    def end(self) -> None:
        """Restore the process's earlier language."""
        if self._before is None:
            return
        _now.clear()
        before, self._before = self._before, None
        import gettext

        gettext.textdomain(self._of_click)
        if before:
            os.environ["LANGUAGE"] = before
        else:
            del os.environ["LANGUAGE"]


def chosen_language(arguments: Sequence[str], environment: Mapping[str, str]) -> str:
    """Return the language of a command line; English for those that robolink lacks.

    Args:
        arguments: The command line without the program's name.
        environment: The variables of the process.
    """
    if any(word in arguments for word in _FOR_MACHINES):
        return ENGLISH
    for name in (_typed(arguments), environment.get(VARIABLE), _from_files(environment)):
        if name:
            return language_named(name) or ENGLISH
    return _of_system(environment) or ENGLISH


def _of_system(environment: Mapping[str, str]) -> str | None:
    """Return the system's language, ``None`` for one that robolink lacks.

    LANGUAGE names those that a person would rather read, the best first; like gettext, it is heard
    only where the locale is no bare C (GNU gettext manual, "Specifying a Priority List").
    """
    name = next((environment[key] for key in _SYSTEM if environment.get(key)), "")
    rather = environment.get(_RATHER, "") if name.partition(".")[0] not in _BARE else ""
    for one in filter(None, rather.split(":")):
        if (known := language_named(one)) is not None:
            return known
    return language_named(name or _of_windows())


def _typed(arguments: Sequence[str]) -> str:
    """Return what stands behind ``--lang``, the last that was typed."""
    found = ""
    for place, word in enumerate(arguments):
        if word == "--":
            break
        if word.startswith(f"{OPTION}="):
            found = word.partition("=")[2]
        elif word == OPTION and place + 1 < len(arguments):
            found = arguments[place + 1]
    return found


def _from_files(environment: Mapping[str, str]) -> str:
    """Return ``language`` of the first cell file that has one; a site's file does not count."""
    named = environment.get("ROBOLINK_CONFIG", "")
    files = [os.path.expanduser(named)] if named else []
    for path in (*files, "robolink.toml", _of_user(environment)):
        try:
            with open(path, encoding="utf-8") as file:
                text = file.read()
        except (OSError, UnicodeError):
            continue  # the command that needs the file reports its errors
        if _KEY in text and (language := _language_in(text)):
            return language
    return ""


def _language_in(text: str) -> str:
    import tomllib  # here, because few files name a language

    try:
        language = tomllib.loads(text).get(_KEY, "")
    except tomllib.TOMLDecodeError:
        return ""
    return language if isinstance(language, str) else ""


def _of_user(environment: Mapping[str, str]) -> str:
    """Return the user's cell file.

    A test compares it with platformdirs, which ``--help`` does not load: it costs as much as
    half of click.
    """
    if os.name == "nt":
        folder = environment.get("LOCALAPPDATA", "")
    elif sys.platform == "darwin":
        folder = os.path.expanduser("~/Library/Application Support")
    else:
        folder = environment.get("XDG_CONFIG_HOME", "").strip() or os.path.expanduser("~/.config")
    return os.path.join(folder, "robolink", "robolink.toml")


def _of_windows() -> str:
    """Return the language of the desktop; Windows sets no variable for it."""
    if sys.platform != "win32":
        return ""
    import ctypes
    import locale

    return locale.windows_locale.get(ctypes.windll.kernel32.GetUserDefaultUILanguage(), "")


def _shown_here(language: str) -> bool:
    """Return whether the console has the characters, and say if not."""
    if person_here() is Person.WIRE:
        return True  # a page shows every character
    encoding = _unshown_here(language)
    if encoding is not None:
        _remark(
            tr(
                "This window cannot show Chinese (its encoding is {encoding}), so robolink "
                "uses English.",
                encoding=encoding,
            )
        )
    return encoding is None


def _unshown_here(language: str) -> str | None:
    """Return the encoding of the console that lacks the characters, ``None`` for none."""
    sample = _SAMPLE[language]
    for stream in (sys.stdout, sys.stderr):
        encoding = getattr(stream, "encoding", None)
        try:
            sample.encode(encoding or "utf-8")
        except (UnicodeError, LookupError):
            return str(encoding)
    return None


def _remark(sentence: str) -> None:
    from robolink_cli.console.output import show

    show(sentence, beside=True)
