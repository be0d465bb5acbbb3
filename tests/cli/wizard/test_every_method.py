"""Every method that moves, in both languages, by keys and by lines, completed and interrupted.

ENTER, blanks and a scanner are tried first at every question. The result is read from the
controller by a separate connection.
"""

import re

import pytest

import robolink
from robolink import messages
from robolink.errors import DeclinedError, RobolinkError
from robolink.interrupts import Interrupted
from tests._commands import chinese
from tests.cli.wizard._every_method import ABORTS, changing, moments_of, stored
from tests.contract.test_proof_after_a_break import CASES

pytestmark = pytest.mark.simulator_only

HAN = re.compile("[\u4e00-\u9fff]")
EACH_TIME = "one-touch"
"""The method of the default suite; the others run only in ``make soak``."""

FACES = [("keys", "en"), ("lines", "zh"), ("keys", "zh"), ("lines", "en")]


def soaked(method, *more, kept=False):
    return pytest.param(method, *more, marks=() if kept else pytest.mark.soak)


@pytest.fixture
def language(request):
    before = messages._translate
    messages.install(chinese() if request.param == "zh" else None)
    yield request.param
    messages.install(before)


def check_language(hand, language):
    said = "".join(hand.state.ended.lines) if hand.state.ended is not None else ""
    assert bool(HAN.search(said)) is (language == "zh" and bool(said)), said


def check_as_before(cell, before):
    """Check for the old value, the earlier tool selected, and nothing open."""
    assert stored(cell) == before
    with robolink.connect(cell.url) as controller:
        assert controller.tools.selected() == 1
        assert controller.outcomes.open_markers() == ()


def on_faces(method, moments=("",)):
    """Return a method at each moment in each interface: in the default suite one per moment."""
    return [
        soaked(method, moment, face, language, kept=method == EACH_TIME and (number + at) % 4 == 0)
        for number, moment in enumerate(moments)
        for at, (face, language) in enumerate(FACES)
    ]


@pytest.mark.parametrize(
    ("method", "moment", "face", "language"),
    [one for name in CASES for one in on_faces(name)],
    indirect=["language"],
)
def test_a_change_is_carried_out(method, moment, face, language):
    assert not moment
    with changing(method, lines=face == "lines") as (hand, cell):
        assert hand.error is None, hand.error
        assert set(moments_of(method)) <= set(hand.seen)
        assert hand.state.ended is not None
        assert hand.state.report is not None
        assert hand.state.ended.done
        check_language(hand, language)
        (receipt,) = (one.receipt for one in hand.state.report.tools)
        assert receipt is not None
        assert stored(cell) == receipt.read_back


def stop(hand):
    if hand.lines and hand.state.question is not None:
        hand.type("\u505c\u6b62")
    else:
        hand.press("stop")


@pytest.mark.parametrize(
    ("method", "moment", "face", "language"),
    [one for name in CASES for one in on_faces(name, moments_of(name))],
    indirect=["language"],
)
def test_a_stop_leaves_all_as_it_was(method, moment, face, language):
    held = []

    def breaks(hand):
        held.append(before_of(method))
        stop(hand)

    with changing(method, lines=face == "lines", break_at=moment, breaks=breaks) as (hand, cell):
        assert hand.broken
        assert isinstance(hand.error, (DeclinedError, Interrupted)), repr(hand.error)
        check_as_before(cell, held[0])
        check_language(hand, language)


def before_of(method):
    """Return the stored offset of the tool in a fresh cell of a method."""
    with CASES[method].cell() as cell:
        return stored(cell)


def press_the_stop(hand):
    """Press the emergency stop and jog on: a PLC whose drives never had power shows it then."""
    hand.cell.simulator.panel.press_estop()
    if hand.state.at_place:
        hand.type("z+0.1")


ENDS = {
    "link": lambda hand: hand.cell.simulator.panel.cut_link(),
    "estop": press_the_stop,
    "nobody": lambda hand: hand.desk.leave(),
}


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize(
    ("method", "moment", "language"),
    [
        soaked(name, moment, language, kept=(name, moment, language) == (EACH_TIME, "touch", "zh"))
        for name in CASES
        for moment in moments_of(name)
        if moment != "moving"
        for language in ("en", "zh")
    ],
    indirect=["language"],
)
def test_what_ends_it_from_outside_writes_nothing_new(method, moment, end, language):
    with changing(method, lines=False, break_at=moment, breaks=ENDS[end]) as (hand, cell):
        assert hand.broken
        assert isinstance(hand.error, RobolinkError), repr(hand.error)
        if end == "nobody":
            check_as_before(cell, before_of(method))
        elif moment != "turn test":
            assert stored(cell) == before_of(method)
        check_language(hand, language)


def blind(hand):
    """Start with a sensor whose cable has come off."""
    world = hand.cell.simulator.world
    for number in (3, 4, 5):
        world.disconnect(number)
    hand.broken = False
    hand.break_at = ""
    hand.press(*["2", "5"] * 3)


@pytest.mark.parametrize("method", [soaked("beams"), soaked("z-touch", kept=True)])
def test_an_instrument_that_failed_names_the_way_with_typed_poses(method):
    with changing(method, lines=False, break_at="check", breaks=blind) as (hand, cell):
        assert isinstance(hand.error, RobolinkError)
        assert hand.state.ended is not None
        assert any("to type poses" in line for line in hand.state.ended.lines)
        check_as_before(cell, before_of(method))


def test_each_way_to_break_off_comes_in_some_method():
    assert {moment for name in CASES for moment in moments_of(name)} == set(ABORTS)
