"""Status flags, error codes and the command table."""

from dataclasses import fields

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.protocols.epson_text import (
    COMMANDS,
    ErrorCode,
    ParameterForm,
    Reply,
    StatusFlags,
    find_command,
    parse_status,
    status_fields,
)

FLAGS = st.builds(StatusFlags, *(st.booleans() for _ in fields(StatusFlags)))


@pytest.mark.parametrize(
    ("word", "flags"),
    [
        ("00100000001", StatusFlags(auto=True, ready=True)),
        ("0100000001", StatusFlags(auto=True, ready=True)),
        ("00100000010", StatusFlags(auto=True, running=True)),
        ("10000000000", StatusFlags(test=True)),
        ("1000000000", StatusFlags(teach=True)),
        ("00001000000", StatusFlags(serious_error=True)),
        ("0000100000", StatusFlags(safeguard=True)),
        ("00000011000", StatusFlags(emergency_stop=True, error=True)),
        ("00010000100", StatusFlags(warning=True, paused=True)),
    ],
)
def test_flags_are_read_from_the_right_in_both_lengths(word, flags):
    assert parse_status(Reply("getStatus", (word, "0517"))) == (flags, 517)


@pytest.mark.parametrize(
    "reply",
    [
        Reply("GetStatus", ("001000000010", "0000")),
        Reply("GetStatus", ("010000000", "0000")),
        Reply("GetStatus", ("0010000000x", "0000")),
        Reply("GetStatus", ("00100000002", "0000")),
        Reply("GetStatus", ("00100000001", "000")),
        Reply("GetStatus", ("00100000001", "00000")),
        Reply("GetStatus", ("00100000001", "-001")),
        Reply("GetStatus", ("00100000001", "\u0661000")),
        Reply("GetStatus", ("00100000001",)),
        Reply("GetStatus", ("00100000001", "0000", "0")),
        Reply("GetStatus", text="00100000001,0000"),
        Reply("GetAlm", ("00100000001", "0000")),
    ],
)
def test_a_status_that_makes_no_sense_is_refused(reply):
    with pytest.raises(RemoteProtocolError):
        parse_status(reply)


@settings(max_examples=60, deadline=None)
@given(FLAGS, st.integers(0, 9999))
def test_eleven_digits_come_back_as_the_same_flags(flags, code):
    assert parse_status(Reply("GetStatus", status_fields(flags, code))) == (flags, code)


@settings(max_examples=60, deadline=None)
@given(FLAGS, st.integers(0, 9999))
def test_ten_digits_lose_only_the_test_flag(flags, code):
    word, digits = status_fields(flags, code, 10)
    found, number = parse_status(Reply("GetStatus", (word, digits)))
    assert (len(word), found.test, number) == (10, False, code)
    for field in fields(StatusFlags)[1:]:
        assert getattr(found, field.name) == getattr(flags, field.name)


@pytest.mark.parametrize("code", [-1, 10_000])
def test_a_code_that_needs_more_than_four_digits_is_refused(code):
    with pytest.raises(LocalProtocolError):
        status_fields(StatusFlags(), code)


def test_every_error_code_has_its_own_meaning():
    assert {int(code) for code in ErrorCode} == {10, 11, 12, 13, 14, 15, 16, 19, 20, 21, 98, 99}
    assert len({code.meaning for code in ErrorCode}) == len(ErrorCode)


def test_every_command_is_found_in_any_case_and_stands_once():
    assert len({command.name.lower() for command in COMMANDS}) == len(COMMANDS) == 54
    for command in COMMANDS:
        assert find_command(command.name.swapcase()) is command
    assert find_command("Nope") is None
    assert find_command("GetStatus ") is None
    assert find_command("Set\u212aotorsOn") is None


def test_preconditions_name_real_flags_and_do_not_contradict_each_other():
    names = {field.name for field in fields(StatusFlags)}
    for command in COMMANDS:
        assert command.needs | command.forbids <= names
        assert not command.needs & command.forbids
        assert 0 <= command.min_parameters <= command.max_parameters


def test_only_queries_login_and_logout_are_served_to_a_monitor():
    for command in COMMANDS:
        harmless = command.name.startswith("Get") or command.name in ("Login", "Logout")
        assert command.in_monitoring == harmless
        if command.in_monitoring:
            assert not command.needs


def test_a_running_execute_leaves_room_for_abort_status_and_later_outputs():
    def served(rc_plus: int) -> set[str]:
        return {c.name for c in COMMANDS if c.allowed_during_execute(rc_plus)}

    assert served(5) == {"Abort", "GetStatus"}
    outputs = {f"Set{kind}{size}" for kind in ("IO", "MemIO") for size in ("", "Byte", "Word")}
    assert served(7) == served(8) == {"Abort", "GetStatus"} | outputs


def test_what_moves_the_robot_needs_the_guard_closed():
    for name in ("Start", "Home", "Execute", "SetMotorsOn"):
        command = find_command(name)
        assert command is not None
        assert {"safeguard", "emergency_stop"} <= command.forbids
        assert command.needs == {"auto", "ready"}


def test_only_execute_takes_a_statement_and_only_login_a_password():
    by_form = {form: [c.name for c in COMMANDS if c.form is form] for form in ParameterForm}
    assert by_form[ParameterForm.STATEMENT] == ["Execute"]
    assert by_form[ParameterForm.PASSWORD] == ["Login"]
    assert by_form[ParameterForm.VARIABLE] == ["GetVariable", "SetVariable"]
