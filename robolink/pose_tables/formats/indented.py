"""The part of YAML in which messages of ROS are printed: blocks by indent, lists, flow brackets.

Tags, anchors and texts of several lines are refused: no list of poses needs them.
"""

import re
from collections.abc import Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.values import UnusableText

_KEY: Final = re.compile(
    r"(\"[^\"]*\"|'[^']*'|[^\s\"'\[\]{},#&*!|>%@-][^:\[\]{}]*?)\s*:(?:\s+(.*))?"
)
_LISTED: Final = re.compile(r"- +[A-Za-z_]\w*:(?:\s|$)")
_NUMBER: Final = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_COMMENT: Final = re.compile(r"(?:^|\s)#.*$")
_FLOW: Final = re.compile(r"\s*([\[\]{},:]|\"[^\"]*\"|'[^']*'|[^\[\]{},:\"']+)")
_DEEPEST: Final = 40

Entry = tuple[int, int, str]
"""Line number, indent and text."""


def looks_indented(lines: Sequence[str]) -> bool:
    """Return whether lines are keys with colons of which one at least opens a block."""
    texts = [text for text in (_COMMENT.sub("", line).strip() for line in lines[:60]) if text]
    opens = any(text.endswith(":") for text in texts)
    keys = [_KEY.fullmatch(text.lstrip("- ")) or text[:3] in ("---", "...") for text in texts]
    plain = [text.startswith("- ") or text[0] in "[{" for text in texts]
    listed = any(text.startswith(("- {", "{")) or _LISTED.match(text) for text in texts)
    return (opens or listed) and all(key or other for key, other in zip(keys, plain, strict=True))


def read_indented(lines: Sequence[str]) -> list[object]:
    """Return the documents of a text: dictionaries, lists, numbers and texts.

    Raises:
        UnusableText: It is laid out in another way.
    """
    documents: list[object] = []
    entries: list[Entry] = []
    for number, line in enumerate([*lines, "---"], start=1):
        text = _COMMENT.sub("", line).rstrip()
        if text.strip() in ("---", "..."):
            if entries:
                documents.append(_document(entries))
            entries = []
        elif text.strip():
            body = text.lstrip(" ")
            if body.startswith("\t"):
                raise UnusableText(tr("a tab indents it"), number)
            entries.append((number, len(text) - len(body), body))
    return documents


def _document(entries: list[Entry]) -> object:
    value, end = _block(entries, 0, 0)
    if end < len(entries):
        raise UnusableText(tr("its indent fits nothing above"), entries[end][0])
    return value


def _block(entries: list[Entry], start: int, depth: int) -> tuple[object, int]:
    line, indent, text = entries[start]
    if depth > _DEEPEST:
        raise UnusableText(tr("it is nested too deeply"), line)
    if text == "-" or text.startswith("- "):
        return _list(entries, start, indent, depth)
    if _KEY.fullmatch(text):
        return _mapping(entries, start, indent, depth)
    return _scalar(text, line), start + 1


def _list(entries: list[Entry], start: int, indent: int, depth: int) -> tuple[object, int]:
    found: list[object] = []
    place = start
    while place < len(entries):
        line, here, text = entries[place]
        if here != indent or not (text == "-" or text.startswith("- ")):
            break
        rest = text[1:].lstrip(" ")
        if rest:
            entries[place] = (line, indent + len(text) - len(rest), rest)
        else:
            place += 1
        if place >= len(entries) or entries[place][1] <= indent:
            found.append(None)
            continue
        value, place = _block(entries, place, depth + 1)
        found.append(value)
    return found, place


def _mapping(entries: list[Entry], start: int, indent: int, depth: int) -> tuple[object, int]:
    found: dict[str, object] = {}
    place = start
    while place < len(entries):
        line, here, text = entries[place]
        key = _KEY.fullmatch(text)
        if here != indent or key is None or text.startswith("- "):
            break
        name, rest = key[1].strip("\"'"), key[2]
        if name in found:
            raise UnusableText(tr("{name} appears twice", name=name), line)
        place += 1
        if rest:
            found[name] = _scalar(rest, line)
            continue
        found[name] = None
        if place < len(entries) and _opens(entries[place], indent):
            found[name], place = _block(entries, place, depth + 1)
    return found, place


def _opens(entry: Entry, indent: int) -> bool:
    """Return whether a line belongs to the key above; lists may stand as far left as their key."""
    _, here, text = entry
    return here > indent or (here == indent and (text == "-" or text.startswith("- ")))


def _scalar(text: str, line: int) -> object:
    text = text.strip()
    if text[:1] in ("[", "{"):
        tokens = [token.strip() for token in _FLOW.findall(text)]
        value, end = _flow(tokens, 0, line, 0)
        if end != len(tokens):
            raise UnusableText(tr("its brackets do not match"), line)
        return value
    if _NUMBER.fullmatch(text):
        return float(text)
    return None if text in ("null", "~") else text.strip("\"'")


def _flow(tokens: list[str], place: int, line: int, depth: int) -> tuple[object, int]:
    if place >= len(tokens) or depth > _DEEPEST:
        raise UnusableText(tr("its brackets do not match"), line)
    token = tokens[place]
    if token not in ("[", "{"):
        return _scalar(token, line), place + 1
    items: list[object] = []
    pairs: dict[str, object] = {}
    place += 1
    while place < len(tokens) and tokens[place] not in ("]", "}"):
        if tokens[place] == ",":
            place += 1
            continue
        if token == "{":
            name = tokens[place].strip("\"'")
            if place + 1 >= len(tokens) or tokens[place + 1] != ":" or name in pairs:
                raise UnusableText(tr("its brackets do not match"), line)
            pairs[name], place = _flow(tokens, place + 2, line, depth + 1)
        else:
            value, place = _flow(tokens, place, line, depth + 1)
            items.append(value)
    if place >= len(tokens) or tokens[place] != {"[": "]", "{": "}"}[token]:
        raise UnusableText(tr("its brackets do not match"), line)
    return (pairs if token == "{" else items), place + 1
