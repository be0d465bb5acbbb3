"""Valid input with a few changes, because random input is almost always refused at once.

In the suite each statement is tried on the same few examples every time; ``make soak`` tries it on
many new ones each time.
"""

import struct
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robolink.protocols.mailbox import crc16

Decorator = Callable[[Callable[..., None]], Callable[[int], None]]

WORD_EDGES = (0, 1, 2, 15, 16, 255, 256, 0x7F80, 0x7FF0, 0x7FFF, 0x8000, 0xFFF0, 0xFFFF)
WORDS = st.sampled_from(WORD_EDGES) | st.integers(0, 0xFFFF)
LREALS = st.sampled_from((0.0, -0.0, 1e-320, 1e308, -1e308, float("nan"), float("inf"), 9999.0))
LREALS |= st.floats(width=64)
BYTES = st.sampled_from(b'\0\r\n\t",$#!;()+-.eE09:\x1b\x7f\x80\xff') | st.integers(0, 255)


def fuzzed(few: int, many: int, **drawn: st.SearchStrategy[Any]) -> Decorator:
    """Run a test on ``few`` examples of what is ``drawn``; in ``make soak`` on ``many``."""

    def decorate(test: Callable[..., None]) -> Callable[[int], None]:
        @pytest.mark.timeout(600)
        @pytest.mark.parametrize("examples", [few, pytest.param(many, marks=pytest.mark.soak)])
        def run(examples: int) -> None:
            def once(**values: object) -> None:
                test(**values)

            settings(
                max_examples=examples,
                derandomize=examples == few,
                deadline=None,
                database=None,
                suppress_health_check=list(HealthCheck),
            )(given(**drawn)(once))()

        # Not functools.wraps: pytest would look for fixtures with the names of the drawn values.
        run.__name__, run.__doc__, run.__module__ = test.__name__, test.__doc__, test.__module__
        return run

    return decorate


@st.composite
def edited_words(draw: st.DrawFn, valid: tuple[int, ...]) -> list[int]:
    """Return words of a block with up to four places changed: words, or whole LREALs."""
    words = list(valid)
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(words) - 1))
        if draw(st.booleans()):
            words[at] = draw(WORDS)
        else:
            number = struct.unpack("<4H", struct.pack("<d", draw(LREALS)))
            words[at : at + 4] = number[: len(words) - at]
    return words


def sealed(words: list[int], crc_at: int) -> tuple[int, ...]:
    """Return a block with a correct checksum, and its end equal to its beginning."""
    sealed_words = list(words)
    sealed_words[crc_at] = crc16(sealed_words[:crc_at])
    sealed_words[-1] = sealed_words[0]
    return tuple(sealed_words)


@st.composite
def edited_bytes(draw: st.DrawFn, valid: bytes) -> bytes:
    """Return bytes with up to five changed, left out, doubled or inserted."""
    data = bytearray(valid)
    for _ in range(draw(st.integers(1, 5))):
        at = draw(st.integers(0, len(data)))
        match draw(st.sampled_from(("change", "insert", "delete", "double", "swap", "many"))):
            case "change":
                data[at : at + 1] = bytes([draw(BYTES)])
            case "insert":
                data[at:at] = bytes([draw(BYTES)])
            case "delete":
                del data[at : at + draw(st.integers(1, 8))]
            case "double":
                data[at:at] = data[at : at + 12]
            case "swap":
                data[at : at + 2] = data[at : at + 2][::-1]
            case "many":
                data[at:at] = bytes([draw(BYTES)]) * draw(st.sampled_from((40, 400, 5000)))
    return bytes(data)
