"""Lines that differ in their numbers alone: what is filled is what would have been read."""

import pytest
from robolink_simulators.epson.condition import SpelRefusal
from robolink_simulators.epson.spel.parser import _read, filler, marked, parse

LINES = [
    "Go XY(172.331, -477.810, -96.529, 0.000) /R /0",
    "Move XY(172.331, 477.810, 0.5, 30.000) /L /1 Till Sw(3) = On",
    "TLSet 1, XY(12.328, -3.056, -20.000, 0.000)",
    "Print XY(1.25, 2.50, 3, 4.0) -TLZ(10.5) +X50.5 :Z(1.5)",
    "Wait 0.25; Print 2.5 * -1.5e3, .5, 5., 0.987654321",
    "P1 = XY(1.5, 1.5, 2.5, 3.5); Print CX(P1) / 1.5",
    'Print "1.5", 1.5',
    "Print 1.5 ' 2.5",
    "Box 1, 0.5, 10.25, -5.5, 5.5, -100.5, 0.5",
    "Arc XY(1.5, 2.5, 3.5, 4.5), XY(5.5, 6.5, 7.5, 8.5) CP",
    "Go P1 !D50.5; On 3!",
]


def ended(read, line):
    try:
        return read(line)
    except SpelRefusal as refusal:
        return str(refusal)


@pytest.mark.parametrize("line", LINES)
def test_a_filled_line_is_the_line_that_was_read(line):
    assert ended(parse, line) == ended(_read, line)
    # And with other numbers, when its shape is known.
    other = line.replace("5", "7")
    assert ended(parse, other) == ended(_read, other)


def test_a_line_that_is_wrong_is_refused_by_its_own_text():
    for line in ("Go XY(1.5, 2.5", "Go XY(1.5, 2.5, 3.5, 4.5) 6.25"):
        with pytest.raises(SpelRefusal) as told:
            parse(line)
        assert str(told.value) == ended(_read, line)
        assert "987654321" not in str(told.value)


def test_a_mark_that_does_not_come_back_just_once_fills_nothing():
    shape, numbers = marked("Print 1.5, 2.5")
    tree = _read(shape)
    assert filler(tree, len(numbers)) is not None
    assert filler(tree, 3) is None
    assert filler((*tree, *tree), 2) is None
