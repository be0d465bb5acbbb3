"""What stands on a controller is told from what was begun, answered, read and recorded."""

import pytest

from robolink.model import Ledger, Marker, MarkerKind, ToolOffset, describe_standing, plain_offset
from robolink.standing import UNTOUCHED, Effect, standing_after

OLD, NEW = ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.5, -3.5, -20.0)
WHEN = "2026-01-01T00:00:00+00:00"


def write(tool=1, before=OLD, requested=NEW, operation="w"):
    details = {"tool": tool, "before": plain_offset(before), "requested": plain_offset(requested)}
    return Marker(operation, MarkerKind.SET, f"TLSet {tool}", WHEN, details)


def select(tool, before, operation="s"):
    return Marker(
        operation, MarkerKind.SET, f"Tool {tool}", WHEN, {"select": tool, "before": before}
    )


def move(operation="m"):
    return Marker(operation, MarkerKind.MOVE, "Go P1", WHEN)


@pytest.fixture
def ledger():
    return Ledger()


def done(ledger, marker, found):
    ledger.begin(marker)
    ledger.answered(marker)
    ledger.proved(marker, found)
    ledger.ended(marker)
    ledger.recorded(marker)


def test_nothing_begun_is_untouched(ledger):
    assert ledger.standing() == UNTOUCHED
    assert ledger.standing().untouched


def test_a_write_is_unknown_until_it_is_read_and_settled_when_it_is_recorded(ledger):
    marker = write()
    ledger.begin(marker)
    assert (ledger.standing().effect, ledger.standing().settled) == (Effect.UNKNOWN, False)
    ledger.proved(marker, NEW)
    assert (ledger.standing().effect, ledger.standing().settled) == (Effect.CHANGED, False)
    ledger.ended(marker)
    assert not ledger.standing().settled, "its marker is still there"
    ledger.recorded(marker)
    standing = ledger.standing()
    assert (standing.effect, standing.settled) == (Effect.CHANGED, True)
    assert standing.tools[1].holds == NEW.components()


def test_a_refused_write_changed_nothing(ledger):
    marker = write()
    ledger.begin(marker)
    ledger.ended(marker)
    ledger.recorded(marker)
    assert (ledger.standing().effect, ledger.standing().settled) == (Effect.UNCHANGED, True)
    assert not ledger.standing().untouched


def test_a_tool_that_is_read_settles_a_doubt_only_when_the_controller_was_done_with_it(ledger):
    marker = write()
    ledger.begin(marker)
    ledger.saw_tool(1, OLD)
    assert ledger.standing().effect is Effect.UNKNOWN, "the write may still be on its way"
    ledger.answered(marker)
    ledger.saw_tool(1, OLD)
    assert ledger.standing().effect is Effect.UNCHANGED
    assert ledger.open_writes(1) == (marker,)


def test_a_value_that_was_put_back_is_no_change(ledger):
    done(ledger, write(), NEW)
    done(ledger, write(before=NEW, requested=OLD, operation="back"), OLD)
    assert ledger.standing().effect is Effect.UNCHANGED


def test_what_nobody_kept_is_not_settled_until_it_is_put_back(ledger):
    account = ledger.open()
    done(ledger, write(), NEW)
    ledger.close(account, kept=False)
    assert not ledger.standing().settled
    done(ledger, write(before=NEW, requested=OLD, operation="back"), OLD)
    assert ledger.standing().settled


def test_an_account_tells_only_of_its_own_block(ledger):
    done(ledger, write(), NEW)
    with pytest.raises(OSError, match="disk") as caught, ledger.block():
        raise OSError("disk")
    assert standing_after(caught.value).effect is Effect.UNCHANGED
    assert ledger.standing().effect is Effect.CHANGED


def test_ctrl_c_carries_what_stands_too(ledger):
    with pytest.raises(KeyboardInterrupt) as caught, ledger.block():
        ledger.begin(move())
        raise KeyboardInterrupt
    assert standing_after(caught.value).moving == ("Go P1",)


def test_a_movement_that_ended_changes_nothing_that_is_kept(ledger):
    ledger.begin(move())
    assert ledger.standing().effect is Effect.UNKNOWN
    ledger.ended(move())
    ledger.recorded(move())
    assert (ledger.standing().effect, ledger.standing().moved) == (Effect.UNCHANGED, True)


def test_a_selection_is_known_when_it_is_read(ledger):
    ledger.begin(select(0, before=1))
    assert not ledger.standing().selection_known
    ledger.proved(select(0, before=1), 0)
    ledger.ended(select(0, before=1))
    ledger.recorded(select(0, before=1))
    assert (ledger.standing().effect, ledger.standing().selected) == (Effect.CHANGED, 0)
    done(ledger, select(1, before=0, operation="back"), 1)
    assert (ledger.standing().effect, ledger.standing().selected) == (Effect.UNCHANGED, 1)


def test_an_undefined_tool_is_a_value_like_any_other(ledger):
    done(ledger, write(before=None), NEW)
    assert ledger.standing().effect is Effect.CHANGED
    done(ledger, write(before=NEW, requested=None, operation="back"), None)
    assert ledger.standing().effect is Effect.UNCHANGED


def in_doubt(ledger):
    ledger.saw_selected(1)
    ledger.begin(write())


def changed(ledger):
    done(ledger, write(), NEW)


def tool_zero(ledger):
    ledger.begin(Marker("p", MarkerKind.SELECTION, "calibrate tool 1", WHEN, {"tool": 1}))
    done(ledger, select(0, before=1), 0)


def on_the_way(ledger):
    ledger.begin(move())


def output(ledger):
    done(ledger, Marker("o", MarkerKind.SET, "SetIO,8,1", WHEN, {"item": ["output", "8"]}), True)


@pytest.mark.parametrize(
    ("story", "sentence"),
    [
        (
            lambda ledger: None,
            "Nothing was moved. Nothing was written. It was not read which tool is selected.",
        ),
        (
            in_doubt,
            "Nothing was moved. Tool 1 may hold the new value X 12.500 Y -3.500 Z -20.000 U 0.000; "
            "before, it held X 12.000 Y -3.500 Z -20.000 U 0.000. Tool 1 is selected. "
            "Next: robolink recover.",
        ),
        (
            changed,
            "Nothing was moved. Tool 1 now holds X 12.500 Y -3.500 Z -20.000 U 0.000; before, "
            "it held X 12.000 Y -3.500 Z -20.000 U 0.000. It was not read which tool is selected.",
        ),
        (
            tool_zero,
            "Nothing was moved. Nothing was written. Tool 0 is selected now; it was tool 1 before. "
            "Next: robolink recover.",
        ),
        (
            on_the_way,
            "The robot may still be moving; the end of this was not seen: Go P1. Nothing was "
            "written. It was not read which tool is selected. Next: robolink recover.",
        ),
        (
            output,
            "Nothing was moved. This was carried out: SetIO,8,1. "
            "It was not read which tool is selected.",
        ),
    ],
)
def test_what_stands_is_said_in_whole_sentences(ledger, story, sentence):
    story(ledger)
    assert describe_standing(ledger.standing()) == sentence


def test_what_two_connections_left_is_told_as_one():
    first, second = Ledger(), Ledger()
    done(first, write(), NEW)
    first.begin(move())
    first.ended(move())
    second.begin(write(before=NEW, requested=OLD))
    whole = first.standing().followed_by(second.standing())
    assert whole.moved
    assert (whole.tools[1].before, whole.tools[1].known) == (OLD.components(), False)
    assert whole.effect is Effect.UNKNOWN
    done(second, write(before=NEW, requested=OLD), OLD)
    whole = first.standing().followed_by(second.standing())
    assert (whole.tools[1].differs, whole.effect) == (False, Effect.UNCHANGED)


def test_what_one_connection_did_not_look_at_is_as_the_one_before_left_it():
    first, second = Ledger(), Ledger()
    done(first, select(0, 1), 0)
    done(second, write(), NEW)
    whole = first.standing().followed_by(second.standing())
    assert (whole.selected, whole.selected_before, whole.effect) == (0, 1, Effect.CHANGED)
    back = whole.put_back()
    assert (back.selected, back.effect, back.left_open) == (1, Effect.UNCHANGED, False)
    assert describe_standing(back).endswith("as before. Tool 1 is selected.")
