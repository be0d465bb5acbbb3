"""The one door through which a sentence reaches a person.

Every sentence shown to a person is written as ``tr("...")`` where it is used and
collected into ``robolink/locale/robolink.pot`` by ``make messages``; a test fails when
that catalogue is stale. A translation is installed once per process with
:func:`install`; without one the English source sentence is shown.
"""

from collections.abc import Callable

_translate: Callable[[str], str] | None = None


def install(translate: Callable[[str], str] | None) -> None:
    """Use ``translate`` for every sentence from now on (``gettext``'s signature).

    ``None`` goes back to the English source sentences.
    """
    global _translate  # noqa: PLW0603 - one language per process, as with gettext itself
    _translate = translate


def tr(sentence: str, /, **values: object) -> str:
    """Translate ``sentence`` and fill its ``{placeholders}`` from ``values``."""
    text = sentence if _translate is None else _translate(sentence)
    return text.format(**values) if values else text
