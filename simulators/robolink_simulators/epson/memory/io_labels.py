"""Names of inputs, outputs and memory bits, as a project gives them (docs/reference/spel.md 8)."""

from typing import Final, NamedTuple

INPUT: Final = 0
OUTPUT: Final = 1
MEMORY: Final = 2

BIT: Final = 1
BYTE: Final = 8
WORD: Final = 16


class IOLabel(NamedTuple):
    """What a name stands for.

    Attributes:
        kind: Input, output or memory (IOTYPE_INPUT, IOTYPE_OUTPUT, IOTYPE_MEMORY).
        width: Bits of the port: 1, 8 or 16 (IOSIZE_BIT, IOSIZE_BYTE, IOSIZE_WORD).
        number: Its number among those of its kind and width.
        name: As it is written.
    """

    kind: int
    width: int
    number: int
    name: str
