"""The hash chain: each entry holds the hash of the one before, so that no change goes unseen."""

import json
from collections.abc import Iterator, Mapping
from hashlib import sha256
from typing import Any, Final

from robolink.messages import in_english, tr

FIRST: Final = ""
"""Value in the first entry in place of the hash of the previous one."""

# No check for circular values: those raise a RecursionError anyway.
_ENCODER: Final = json.JSONEncoder(
    sort_keys=True, separators=(",", ":"), allow_nan=False, check_circular=False
)


def canonical(value: object) -> str:
    """Return the one JSON text of ``value``: sorted keys, no blanks, ASCII.

    Raises:
        TypeError: It holds something that JSON does not know.
        ValueError: It holds a number that is not finite.
        RecursionError: It holds itself.
    """
    return _ENCODER.encode(value)


def is_json(value: object) -> bool:
    """Whether the JSON text of ``value`` is read as ``value`` again: no tuples, no other keys."""
    if type(value) is dict:
        return all(type(key) is str and is_json(one) for key, one in value.items())
    if type(value) is list:
        return _AS_THEY_ARE.issuperset(map(type, value)) or all(map(is_json, value))
    return type(value) in _AS_THEY_ARE


_AS_THEY_ARE: Final = frozenset({str, float, int, bool, type(None)})


def storable(text: str) -> str:
    """Return ``text`` as every database stores it: in English, valid Unicode without NUL."""
    if type(text) is not str:
        text = in_english(text)
    if text.isascii() and "\0" not in text:
        return text
    return text.encode("utf-8", "backslashreplace").decode().replace("\0", "\\x00")


def digest(row: Mapping[str, object]) -> str:
    """Return the SHA-256 of a stored entry, over every field but the hash itself."""
    return sha256(hashed_text(row).encode()).hexdigest()


def hashed_text(row: Mapping[str, object]) -> str:
    """Return the whole of a stored entry but its hash, as the text of which that is taken."""
    if "hash" in row:
        row = {name: value for name, value in row.items() if name != "hash"}
    return canonical(row)


class ChainCheck:
    """Follows the chain, entry by entry.

    Attributes:
        checked: How many entries were seen.
        number: Number of the last one.
        hash: Its hash.
    """

    def __init__(self) -> None:
        self.checked = 0
        self.number = 0
        self.hash = FIRST

    @classmethod
    def before(cls, row: Mapping[str, Any]) -> "ChainCheck":
        """Return a check that starts at an entry and trusts its link to the one before."""
        return cls.behind(row["number"] - 1, str(row["previous"]))

    @classmethod
    def behind(cls, number: int, its_hash: str) -> "ChainCheck":
        """Return a check of what follows an entry."""
        check = cls()
        check.number, check.hash = number, its_hash
        return check

    def problems_of(self, row: Mapping[str, Any]) -> Iterator[str]:
        """Take the next entry and yield what is wrong with it."""
        number, expected = row["number"], self.number + 1
        if number > expected:
            yield _missing(expected, number - 1)
        if not is_unchanged(row):
            yield tr("Entry {number} was changed after it was stored.", number=number)
        elif number <= expected and row["previous"] != self.hash:
            yield tr("Entry {number} does not follow the one before it.", number=number)
        self.checked += 1
        self.number = number
        self.hash = str(row["hash"])

    def problems_at_end(self, head: tuple[int, str] | None) -> Iterator[str]:
        """Compare the end with number and hash of the entry that was stored last."""
        if head is None:
            yield head_is_missing()
            return
        number, last_hash = head
        if self.number < number:
            yield _missing(self.number + 1, number)
        elif self.number > number:
            yield tr(
                "The journal ends with entry {number}, but there are entries up to {last}.",
                number=number,
                last=self.number,
            )
        elif self.hash != last_hash:
            yield tr("Entry {number} is not the one that was stored last.", number=number)


def head_is_missing() -> str:
    """Return the sentence for a missing note of the last entry."""
    return tr("The note that says which entry was stored last is missing.")


def is_unchanged(row: Mapping[str, Any]) -> bool:
    """Whether a stored row is the one that its hash was made of."""
    try:
        return bool(row["hash"] == digest(row))
    except (TypeError, ValueError):  # a field contains something that robolink never stores
        return False


def _missing(first: int, last: int) -> str:
    """Return the sentence about entries that are gone."""
    if first == last:
        return tr("Entry {number} is missing.", number=first)
    return tr("Entries {first} to {last} are missing.", first=first, last=last)
