"""Blocks as a PLC lays them whose program orders words in its own way.

Source: docs/reference/softmotion.md 4.4.
"""

from collections.abc import Iterator, Sequence

from robolink.protocols.mailbox import Layout, WordOrder, Words, WordType, crc16


def arranged(layout: Layout, words: Sequence[int], order: WordOrder) -> Words:
    """Return a block with its values of several words in another order.

    The same again gives the block back. A checksum that was right is right afterwards: the
    program works it out over its words as they stand.

    Args:
        layout: Of the block.
        words: The block.
        order: Where each word of an LREAL stands; values of two words follow it.
    """
    if order is WordOrder.LOW_FIRST:
        return tuple(words)
    moved = list(words)
    for start, count in _values(layout):
        piece = words[start : start + count]
        if count == 4:
            moved[start : start + count] = order.arrange(piece)
        elif order is not WordOrder.HALVES_SWAPPED:
            moved[start : start + count] = piece[::-1]
    if layout.guarded and layout.intact(words):
        end = layout["crc"].word
        moved[end] = crc16(moved[:end])
    return tuple(moved)


def _values(layout: Layout) -> Iterator[tuple[int, int]]:
    """Give start and length of each value of two or four words."""
    for field in layout.fields:
        size = field.type.words
        if size > 1 and field.type is not WordType.CHARS:
            for start in range(field.word, field.end, size):
                yield start, size
