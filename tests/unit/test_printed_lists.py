"""Lists of numbers as a controller prints them: read as they are, or not at all."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robolink.errors import LocalProtocolError
from robolink.protocols import spel
from robolink.protocols.spel import (
    before_last_number,
    gap_in_known_numbers,
    split_before_point,
    split_numbers,
)
from tests._rows import each_row

GAPS = st.sampled_from([" ", "  ", ", ", ",", "; ", "\t", "", "/", " 1 "])
NUMBERS = st.one_of(
    st.integers(-9999, 9999).map(str),
    st.decimals(-2000, 2000, places=3).map(str),
)
POINT = " X:  158.636 Y:  495.438 Z:  -80.002 U:    0.000 V:    0.000 W:    0.000 /R /0"


@given(GAPS, st.lists(NUMBERS, min_size=1, max_size=8), st.integers(10, 99))
def test_a_list_is_read_as_it_was_printed_or_not_at_all(gap, numbers, own):
    learnt = gap_in_known_numbers(gap.join(("1", "22", "333")))
    if gap.strip(" ,;\t") or not gap:
        assert learnt is None
        return
    assert learnt is not None
    assert learnt == gap
    listed = before_last_number(gap.join((*numbers, str(own))) + "\r\n", own)
    assert listed is not None
    assert split_numbers(listed, learnt, len(numbers)) == tuple(numbers)
    assert split_numbers(listed, learnt, len(numbers) + 1) is None


@given(GAPS, st.lists(NUMBERS, min_size=1, max_size=3), st.integers(10, 99), st.booleans())
def test_a_point_after_numbers_is_read_as_it_was_printed(gap, numbers, own, blank):
    learnt = gap_in_known_numbers(gap.join(("1", "22", "333")))
    if learnt is None:
        return
    printed = gap.join(numbers) + (gap if blank else "") + POINT + gap + str(own)
    listed = before_last_number(printed, own)
    assert listed is not None
    told = split_before_point(listed, learnt, len(numbers))
    assert told is not None
    assert told[0] == tuple(numbers)
    assert spel.parse_point(told[1]) == spel.parse_point(POINT)


@each_row("other", ["1 1 0 5 20", "1 1 0 5 20 98", "7", "", "99", "199", "1 1 0 5 2099"])
def test_an_answer_without_the_own_number_at_its_end_is_another_s(other):
    assert before_last_number(other, 99) is None


@given(st.text(alphabet="1 ,X:-.\t20", max_size=20), st.integers(1, 4))
def test_no_text_breaks_a_reader(text, count):
    numbers = split_numbers(text, " ", count)
    assert numbers is None or len(numbers) == count
    told = split_before_point(text, " ", count)
    assert told is None or len(told[0]) == count


def test_only_what_prints_makes_a_list():
    assert spel.print_several(spel.print_power(), spel.print_number(10)) == "Print Power, 10"
    with pytest.raises(LocalProtocolError):
        spel.print_several(spel.print_power(), spel.where())
