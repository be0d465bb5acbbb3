"""The language of whoever is answered: one process speaks with several tablets at once.

A command speaks one language (:mod:`robolink.messages`). Here the translation that is installed for
the process looks up which language counts where it is asked: that of the tablet that is answered.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Final

from robolink.locale.languages import ENGLISH, language_named, translator
from robolink.messages import install

_language: Final[ContextVar[str]] = ContextVar("language", default=ENGLISH)


def speak_several_languages() -> None:
    """Let every sentence of this process be in the language of :func:`speaking_in`."""
    install(_translated)


@contextmanager
def speaking_in(language: str) -> Iterator[None]:
    """Speak a language, for the block; English where robolink lacks it.

    Args:
        language: One of :data:`robolink.locale.languages.LANGUAGES`.
    """
    token = _language.set(language_named(language) or ENGLISH)
    try:
        yield
    finally:
        _language.reset(token)


def spoken_language() -> str:
    """Return the language that is spoken."""
    return _language.get()


def _translated(sentence: str) -> str:
    translate = _translator(_language.get())
    return sentence if translate is None else translate(sentence)


@cache
def _translator(language: str) -> Callable[[str], str] | None:
    return translator(language)
