"""A view as JSON, and back: whatever a record may hold, and nothing else."""

import copy
import json
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_cli.wizard.happenings import HasEnded, WasRegarded
from robolink_cli.wizard.state import ChoiceSubject, LastScreen
from robolink_cli.wizard.views import records
from robolink_cli.wizard.views.records import Body, EndView, Head, View, WaitView
from robolink_cli.wizard.views.view import view_of
from robolink_cli.wizard.views.wire import KINDS, WireError, from_wire, to_wire

from robolink.model import Path, Pose
from robolink.runner import MoveSubject, Question
from tests.cli.wizard._people import CHECK, Sitting, fit_subject, touch_subject, write_subject

HEAD = Head("line3", "Change needle", "Please wait")


def values_of(hint):
    """Return what draws a value of a type that a record names."""
    if get_origin(hint) in (Union, UnionType):
        return st.one_of(*map(values_of, get_args(hint)))
    if get_origin(hint) is tuple:
        one, *more = get_args(hint)
        if more == [Ellipsis]:
            return st.lists(values_of(one), max_size=2).map(tuple)
        return st.tuples(*map(values_of, (one, *more)))
    if isinstance(hint, type) and is_dataclass(hint):
        parts = get_type_hints(hint).items()
        return st.builds(hint, **{name: values_of(part) for name, part in parts})
    if issubclass(hint, Enum):
        return st.sampled_from(list(hint))
    return PLAIN[hint]


PLAIN = {
    float: st.floats(allow_nan=False, allow_infinity=False),
    str: st.text(max_size=6),
    int: st.integers(-9, 10**6),
    bool: st.booleans(),
    NoneType: st.none(),
}
VIEWS = values_of(View)
FEW = settings(max_examples=25, deadline=None)


def plain(view):
    """Return a view as it stands in JSON; the tests reach into it."""
    written: Any = to_wire(view)
    return written


def through_json(view):
    return from_wire(json.loads(json.dumps(to_wire(view), ensure_ascii=False)))


@FEW
@given(view=VIEWS)
def test_every_view_comes_back_as_it_was(view):
    assert through_json(view) == view


def test_every_kind_of_body_has_a_word_and_every_word_a_body():
    assert set(KINDS.values()) == set(get_args(Body))
    assert len(set(KINDS)) == len(KINDS) == 9


def _parts(data, path=()):
    """Yield each object of a document, with its path."""
    if isinstance(data, dict):
        yield path
        for key, value in data.items():
            yield from _parts(value, (*path, key))
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from _parts(value, (*path, index))


def _at(data, path):
    for key in path:
        data = data[key]
    return data


@FEW
@given(view=VIEWS, data=st.data())
def test_a_key_too_many_or_too_few_is_refused(view, data):
    said = plain(view)
    path = data.draw(st.sampled_from(list(_parts(said))))
    more = copy.deepcopy(said)
    _at(more, path)["surprise"] = 1
    with pytest.raises(WireError):
        from_wire(more)
    less = copy.deepcopy(said)
    part = _at(less, path)
    del part[data.draw(st.sampled_from(sorted(part)))]
    with pytest.raises(WireError):
        from_wire(less)


_OTHERS: tuple[Any, ...] = (None, True, 3, 1.5, "word", [], ["x"], {}, {"kind": "wait", "told": []})


@FEW
@given(view=VIEWS, data=st.data())
def test_a_value_of_another_type_is_refused(view, data):
    said = plain(view)
    path = data.draw(st.sampled_from(list(_parts(said))))
    part = _at(said, path)
    key = data.draw(st.sampled_from(sorted(part)))
    before, other = part[key], data.draw(st.sampled_from(_OTHERS))
    part[key] = other
    try:
        read = from_wire(json.loads(json.dumps(said)))
    except WireError:
        return
    # What is taken all the same is what was sent: a number without a fraction, a null where one
    # may be, an empty list, a word where any text may be.
    again = json.loads(json.dumps(to_wire(read)))
    assert again == json.loads(json.dumps(said)), (path, key, before, other)


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf")])
def test_a_number_that_is_none_goes_neither_way(number):
    view = View(1, True, HEAD, None, EndView(True, "DONE", (), before_mm=number))
    with pytest.raises(WireError):
        to_wire(view)
    said = plain(replace(view, body=EndView(True, "DONE", (), before_mm=1.0)))
    said["body"]["before_mm"] = number
    with pytest.raises(WireError):
        from_wire(said)


@pytest.mark.parametrize("data", [None, [], "view", 3, {"number": True}])
def test_what_is_no_view_at_all_is_refused(data):
    with pytest.raises(WireError):
        from_wire(data)


def moving():
    target = Pose(300.0, 400.0, -60.0, 90.0, tool=0)
    going = MoveSubject(target, Path.STRAIGHT, 20.0, "Up.", "Turn.")
    return Sitting().asked(touch_subject()).happens(WasRegarded(going))


STATES = {
    "wait": Sitting,
    "moving": moving,
    "touch": lambda: Sitting().asked(touch_subject(limit_mm=0.2, types=True)),
    "choice": lambda: Sitting().asked(ChoiceSubject("Choose", (), ("a", "b")), Question.TEXT),
    "check": lambda: Sitting().asked(CHECK, Question.YES_NO),
    "fit": lambda: Sitting().asked(fit_subject(0.01, 0.02, 0.14, worst=2), Question.YES_NO),
    "values": lambda: Sitting().asked(write_subject(1, 2), Question.YES_NO),
    "question": lambda: Sitting().asked(None, Question.YES_NO, text="Is it clear?"),
    "end": lambda: Sitting().happens(HasEnded(LastScreen(True, ("Well.",), (), 1.0, "DONE"))),
}


@pytest.mark.parametrize("kind", STATES)
def test_each_screen_of_the_wizard_goes_over_the_wire(kind):
    hand = STATES[kind]()
    view = view_of(hand.state, hand.now)
    assert isinstance(view.body, KINDS[kind])
    assert plain(view)["body"]["kind"] == kind
    assert through_json(view) == view


def test_a_record_holds_nothing_that_json_lacks():
    for name in vars(records):
        one = getattr(records, name)
        if isinstance(one, type) and is_dataclass(one):
            assert not any("dict" in str(part.type).lower() for part in fields(one)), name


def test_a_wait_has_nothing_but_the_way_out():
    view = view_of(Sitting().state, 10.0)
    assert isinstance(view.body, WaitView)
    assert [one.name for one in view.actions] == ["leave"]
    assert view.number == 0
