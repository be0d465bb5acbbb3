"""Elements of a drawing, and text and figures of a page. All text goes through here."""

import re
import unicodedata
from typing import Any, Final, TypeAlias
from xml.etree.ElementTree import Element, tostring

from markupsafe import Markup

Content: TypeAlias = Element | str | None

_INVISIBLE: Final = ("Cc", "Cf", "Cs")
"""Unicode categories of control characters, characters that change the writing direction, and
surrogates."""

_PLUS_MINUS: Final = re.compile(r"(?<![0-9A-Za-z.])\+-(?: |(?=\d)|\Z)")
"""Plus or minus as every sentence writes it: ASCII consoles can show it too."""


def element(tag: str, *content: Content, **attributes: object) -> Element:
    """Return an element.

    Args:
        tag: Its name.
        content: Text and elements in their order; ``None`` is left out.
        attributes: ``_`` stands for ``-``, and a trailing one is dropped (``class_``);
            ``None`` leaves the attribute out.
    """
    made = Element(tag)
    for name, value in attributes.items():
        if value is not None:
            made.set(name.rstrip("_").replace("_", "-"), plain(str(value)))
    for part in content:
        if isinstance(part, str):
            _append_text(made, plain(part))
        elif part is not None:
            made.append(part)
    return made


def drawing(svg: Element) -> str:
    """Return a drawing as it stands in a page; all text in it is escaped."""
    return tostring(svg, encoding="unicode", method="html")


def plain(text: str) -> str:
    """Return ``text`` with every invisible character replaced, and with the signs of a page.

    Names come from files and controllers; no file name may turn the line around, and
    half a surrogate pair could not be written at all. Sentences say ``+-``, which every console
    has; here is the one place at which that becomes a sign.
    """
    text = _PLUS_MINUS.sub("\u00b1 ", text)
    if text.isprintable():  # nothing invisible is
        return text
    return "".join("\ufffd" if unicodedata.category(c) in _INVISIBLE else c for c in text)


def shown(value: Any) -> Any:  # noqa: ANN401 - any value that a template shows
    """Return what a template shows of a value: no invisible characters, nothing for nothing."""
    if value is None:
        return ""
    if isinstance(value, str) and not isinstance(value, Markup):
        return plain(value)
    return value


def rounded(value: float, digits: int = 3) -> str:
    """Return a number as a person reads it."""
    # Adding zero removes the sign from a value that rounds to zero.
    return f"{round(value, digits) + 0.0:.{digits}f}"


def _append_text(parent: Element, text: str) -> None:
    if len(parent):
        parent[-1].tail = (parent[-1].tail or "") + text
    else:
        parent.text = (parent.text or "") + text
