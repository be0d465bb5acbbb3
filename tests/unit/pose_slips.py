"""Single slips in files of poses, and the outcome of each.

A slip is one thing that goes wrong when a file is typed, copied, printed or mailed: a blank or a
bracket is lost, a letter O stands for 0, a comma for a point, stars for a number that did not fit.
Slips that make another valid file are left out, as nothing in the file shows them: a changed digit,
a missing or moved sign or point, a missing or doubled row or record, and a record turned into a
comment by a blank after its sign.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from robolink.errors import AmbiguousPosesError, CalibrationError, ConfigError
from robolink.pose_tables import ReadingChoices, read_poses

NUMBER = re.compile(
    r"(?<![\w.])[+-]?(?:\d{1,3}(?:\.\d{3})+,\d+|(?:\d+(?:[.,]\d*)?|\.\d+)(?:[eE][+-]?\d+)?)"
    r"(?![\w.])(?<![,])|(?<![\w.])[+-]?\d+\.\d+(?=mm|rad|deg)"
)
KEY = re.compile(r"\s*(?:DECL\b[^=\n]*=|\"?\w+\"?\s*[:=]|global\s+\w+\s*=|(?:CONST|VAR)\b.*:=)")
"""A line that begins with its own name; a doubled row is another row."""
WORD = re.compile(r"[A-Za-z_]+")
SIGNS = "{}[]()<>,;:=\"'/"
OTHER = {"{": "(", "}": ")", "[": "(", "]": ")", "(": "[", ")": "]", ",": ";", ";": ",", ":": ";"}
UNITS = {"mm": ("cm", "m", "inch"), "deg": ("rad", "grad"), "rad": ("deg",), "m": ("mm",)}


@dataclass(frozen=True)
class Slip:
    """One slip: its kind, its line, and the resulting text."""

    kind: str
    line: int
    text: str


def slips_of(text: str) -> Iterator[Slip]:
    """Yield every single slip of a text."""
    for kind, begin, end, put in _pieces(text):
        changed = text[:begin] + put + text[end:]
        if changed != text:
            yield Slip(kind, text.count("\n", 0, begin) + 1, changed)


def _pieces(text: str) -> Iterator[tuple[str, int, int, str]]:
    points = set[int]()
    for found in NUMBER.finditer(text):
        yield from _of_number(text, found)
        points |= {found.start() + at for at, sign in enumerate(found[0]) if sign == ","}
    for place, sign in enumerate(text):
        if sign in SIGNS:
            if place in points:
                continue  # of a decimal comma: see _of_number
            yield f"{sign} missing", place, place + 1, ""
            yield f"{sign} twice", place, place + 1, sign * 2
            if sign in OTHER:
                yield f"{sign} is {OTHER[sign]}", place, place + 1, OTHER[sign]
        elif sign == "\t":
            yield "tab is blank", place, place + 1, " "
            yield "tab missing", place, place + 1, ""
        elif sign == " ":
            yield "blank is tab", place, place + 1, "\t"
            yield "blank is no-break", place, place + 1, "\u00a0"
            yield "blank missing", place, place + 1, ""
    for found in WORD.finditer(text):
        yield from _of_word(found)
    begin = 0
    for line in text.split("\n"):
        end = begin + len(line)
        for share in (0.1, 0.25, 0.5, 0.75, 0.9):
            cut = begin + int(len(line) * share)
            if not text[begin:cut].strip() or not text[cut:end].strip():
                continue  # the whole line is missing
            # Inside the first or the last number a cut only makes another number.
            numbers = [found.span() for found in NUMBER.finditer(text, begin, end)]
            last = [one for one in numbers if not re.search(r"\d[.,]\d", text[one[1] : end])]
            if not any(first < cut < after for first, after in (*numbers[:1], *last)):
                yield "rest of line lost", cut, end, ""
                yield "begin of line lost", begin, cut, ""
                yield "line in two", cut, cut, "\n"
        if KEY.match(line):
            yield "line twice", begin, begin, f"{line}\n"
        if end < len(text):
            yield "line end missing", end, end + 1, ""
        begin = end + 1


def _of_number(text: str, found: re.Match[str]) -> Iterator[tuple[str, int, int, str]]:
    begin, end, number = found.start(), found.end(), found[0]
    for digit, letters in {"0": "Oo", "1": "lI|", "5": "S", "8": "B"}.items():
        for offset in (number.find(digit), number.rfind(digit)):
            for letter in letters if offset >= 0 else "":
                yield f"{letter} for {digit}", begin + offset, begin + offset + 1, letter
    for offset, sign in enumerate(number):
        if sign in ".,":
            place = begin + offset
            yield "comma and point", place, place + 1, "," if sign == "." else "."
            yield "point twice", place, place + 1, sign * 2
            yield "blank for point", place, place + 1, " "
            yield "blank behind point", place + 1, place + 1, " "
            yield "blank before point", place, place, " "
            yield "semicolon for point", place, place + 1, ";"
        elif sign == "-":
            place = begin + offset
            yield "minus twice", place, place + 1, "--"
            yield "plus and minus", place, place + 1, "+-"
            yield "typeset minus", place, place + 1, "\u2212"
            yield "dash", place, place + 1, "\u2013"
            yield "blank behind minus", place + 1, place + 1, " "
        elif sign in "eE":
            place = begin + offset
            yield "exponent without number", place + 1, end, ""
            yield "exponent of a letter", place + 1, end, "+O2"
            yield "blank before exponent", place, place, " "
    yield "number missing", begin, end, ""
    yield "stars", begin, end, "*" * len(number)
    yield "stars with a point", begin, end, "****.***"
    yield "open exponent", end, end, "e"
    yield "open exponent with a sign", end, end, "E+"
    yield "letter behind", end, end, "x"
    yield "letter before", begin, begin, "x"
    yield "quote behind", end, end, '"'
    yield "quote before", begin, begin, "'"
    yield "not a number", begin, end, "nan"
    yield "infinite", begin, end, "-inf"
    yield "error of a spreadsheet", begin, end, "#REF!"
    yield "question mark", begin, begin + 1, "?"
    middle = begin + (end - begin) // 2
    yield "invisible blank", middle, middle, "\u200b"
    yield "no-break blank inside", middle, middle, "\u00a0"
    yield "underscore", middle, middle, "_"
    yield "apostrophe", middle, middle, "'"
    wide = "".join(chr(ord(sign) + 0xFEE0) if sign.isdigit() else sign for sign in number)
    yield "full-width digits", begin, end, wide
    yield "shifted digit", begin, begin + 1, {"1": "!", "3": "#", "5": "%"}.get(number[0], "&")


def _of_word(found: re.Match[str]) -> Iterator[tuple[str, int, int, str]]:
    begin, end, word = found.start(), found.end(), found[0]
    for unit in UNITS.get(word.lower(), ()):
        yield "other unit", begin, end, unit
    yield "word missing", begin, end, ""
    yield "last letter twice", begin, end, word + word[-1]
    yield "other letter", begin, begin + 1, "q" if word[0] != "q" else "j"
    yield "other last letter", end - 1, end, "n" if word[-1] != "n" else "k"
    if len(word) > 1:
        yield "first letter missing", begin, begin + 1, ""
        yield "last letter missing", end - 1, end, ""
        yield "two letters swapped", begin, begin + 2, word[1] + word[0]


def read_as(path: Path, choices: ReadingChoices) -> tuple[tuple[object, ...], ...]:
    """Return the essentials of the poses in a file."""
    from robolink.calibration import rotation_of

    return tuple(
        (
            *(round(value, 6) for value in (e.pose.x_mm, e.pose.y_mm, e.pose.z_mm)),
            *(round(float(value), 6) + 0.0 for value in rotation_of(e.pose).ravel()),
            *(e.pose.hand, e.pose.local, e.pose.tool),
        )
        for e in read_poses(path, choices).entries
    )


def outcome(
    path: Path, choices: ReadingChoices, wanted: tuple[tuple[object, ...], ...]
) -> tuple[str, str]:
    """Return ``same``, ``refused``, ``asked`` or ``silent``, and the message."""
    try:
        found = read_as(path, choices)
    except AmbiguousPosesError as asked:
        return "asked", str(asked)
    except (ConfigError, CalibrationError) as refusal:
        return "refused", refusal.what
    return ("same" if found == wanted else "silent"), str(found)
