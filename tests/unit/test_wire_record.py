"""The record of what crossed the wire: bounded, numbered, and each text held once."""

from robolink_simulators.device import wire_record
from robolink_simulators.device.wire_record import WireLine, WireRecord


def text(number):
    return f"GetIO,{number}"


def test_two_records_hold_the_same_text_once():
    one, another = WireRecord(), WireRecord()
    one.add(1, ">", text(5))
    another.add(2, ">", text(5))
    assert next(iter(one))[2] is next(iter(another))[2]


def test_texts_that_no_record_holds_are_let_go():
    record = WireRecord(most=10)
    for number in range(3 * wire_record.MOST_SHARED):
        record.add(number, "<", text(number))
        assert len(wire_record._shared) <= wire_record.MOST_SHARED
    assert [line.text for line in record.lines()] == [text(it) for it in range(12278, 12288)]


def test_what_was_pushed_out_has_been_counted():
    record = WireRecord(most=2)
    for number in (1, 2, 3):
        record.add(10 * number, ">", text(number))
    assert (record.added, len(record)) == (3, 2)
    assert list(record.lines(after=2)) == [WireLine(3, 30, ">", text(3))]
    assert [line.number for line in record.lines()] == [2, 3]
    record.clear()
    assert (record.added, list(record.lines())) == (0, [])
