"""Finds almost identical sentences of the catalogue: one message in two wordings.

``python -m tests.packaging._near_copies`` prints the pairs that nobody has reviewed.
"""

import re
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from itertools import combinations, pairwise
from pathlib import Path

from babel.messages.pofile import read_po

CATALOGUE = Path(__file__).parents[2] / "robolink" / "locale" / "robolink.pot"
REVIEWED = Path(__file__).with_name("near_copies.txt")
"""Pairs that are meant to differ: two sentences and an empty line each."""

SHORTEST = 6
"""Words; shorter sentences are labels, which may be alike with different meanings."""
MOST = 2
"""The number of words that may be changed, added or missing."""

_VALUE = re.compile(r"(?<!{){[^{}]+}")

Pair = tuple[str, str]


def sentences() -> list[str]:
    """Return the sentences of the catalogue, each as one line."""
    with CATALOGUE.open("rb") as file:
        return [str(message.id).replace("\n", "\\n") for message in read_po(file) if message.id]


def near_copies(said: Iterable[str]) -> Iterator[Pair]:
    """Yield the pairs that differ in at most two words and have the same values."""
    groups = defaultdict(list)
    for sentence in said:
        words = sentence.split()
        if len(words) >= SHORTEST:
            groups[tuple(sorted(_VALUE.findall(sentence)))].append((sentence, words))
    for group in groups.values():
        for one, other in _with_common_words(group):
            if _differing(one[1], other[1]) <= MOST:
                first, second = sorted((one[0], other[0]))
                yield first, second


def reviewed() -> set[Pair]:
    """Return the pairs that somebody has read and left."""
    blocks = REVIEWED.read_text("utf-8").strip("\n").split("\n\n")
    return {(one, other) for one, other in (block.split("\n") for block in blocks)}


def _with_common_words(group):
    """Yield the pairs that share two neighbouring words, as six words of which two differ do."""
    places = defaultdict(list)
    told = [set(words) for _, words in group]
    for number, (_, words) in enumerate(group):
        for two in set(pairwise(words)):
            places[two].append(number)
    seen = {pair for numbers in places.values() for pair in combinations(numbers, 2)}
    for one, other in seen:
        (_, some), (_, others) = group[one], group[other]
        if abs(len(some) - len(others)) <= MOST and len(told[one] - told[other]) <= MOST:
            yield group[one], group[other]


def _differing(one, other) -> int:
    """Return the number of words to insert, delete or change; more than two counts as three."""
    line = list(range(len(other) + 1))
    for row, word in enumerate(one, 1):
        line, above = [row], line
        for column, its in enumerate(other, 1):
            least = min(above[column], line[-1]) + 1
            line.append(min(least, above[column - 1] + (word != its)))
        if min(line) > MOST:
            return MOST + 1
    return line[-1]


if __name__ == "__main__":
    for pair in sorted(set(near_copies(sentences())) - reviewed()):
        sys.stdout.write("\n".join(pair) + "\n\n")
