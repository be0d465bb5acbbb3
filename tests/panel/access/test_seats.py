"""A second tablet: it watches, it reads who has the seat, and it never commands."""

import pytest
from robolink_cli.panel.guard.pairing import LoggedIn, Tablet
from robolink_cli.panel.guard.seat import SILENCE_S, Seats

from tests.panel.access._bare import CELL, JON, MEI, Clock


def tablet(name, who=""):
    return Tablet(name, f"10.0.0.{ord(name[0])}", paired=True, session=LoggedIn(who, "operator", 0))


A, B = tablet("a", MEI), tablet("b", JON)


@pytest.fixture
def seats():
    return Seats(Clock())


def test_one_a_cell(seats):
    assert seats.take(CELL, A, moving=False).why_not == ""
    assert seats.has(CELL, "a")
    assert not seats.has(CELL, "b")
    assert not seats.has("other", "a")
    taking = seats.take(CELL, B, moving=False)
    assert (taking.why_not, taking.from_whom.who) == ("", MEI)
    assert seats.has(CELL, "b")
    assert not seats.has(CELL, "a")


def test_not_taken_while_the_robot_moves_or_may(seats):
    seats.take(CELL, A, moving=True)  # nobody's: there is nobody to take it from
    for moving in (True, None):
        taking = seats.take(CELL, B, moving=moving)
        assert MEI in taking.why_not
        assert A.address in taking.why_not
        assert seats.has(CELL, "a")


def test_not_even_of_a_tablet_that_is_silent_or_logged_out(seats):
    seats.take(CELL, A, moving=False)
    seats.clock.sleep(10 * SILENCE_S)
    assert seats.holder(CELL, moving=True).who == MEI
    assert seats.holder(CELL).who == MEI
    assert seats.take(CELL, B, moving=True).why_not
    assert seats.leave_all("a") == (CELL,)
    assert not seats.has(CELL, "a")  # it commands nothing any more
    assert seats.take(CELL, B, moving=True).why_not
    assert seats.holder(CELL, moving=False) is None
    assert seats.take(CELL, B, moving=False) == seats.take(CELL, B, moving=True)


def test_free_after_a_silence_at_rest_and_not_before(seats):
    seats.take(CELL, A, moving=False)
    seats.clock.sleep(SILENCE_S - 1)
    assert seats.holder(CELL, moving=False).who == MEI
    seats.heard("a")
    seats.clock.sleep(SILENCE_S - 1)
    assert seats.holder(CELL, moving=False).who == MEI
    assert SILENCE_S - 2 < seats.silent_s(CELL) < SILENCE_S
    seats.clock.sleep(2)
    assert seats.holder(CELL, moving=False) is None
    assert seats.take(CELL, B, moving=False).from_whom is None


def test_the_other_tablet_reads_who_took_it(seats):
    seats.take(CELL, A, moving=False)
    seats.take(CELL, B, moving=False)
    assert JON in seats.taken_by(CELL, "a").sentence
    assert seats.taken_by(CELL, "b") is None
    seats.take(CELL, A, moving=False)
    assert seats.taken_by(CELL, "a") is None
    assert MEI in seats.taken_by(CELL, "b").sentence


def test_it_survives_a_reload_and_another_login_of_the_tablet_is_on_it(seats):
    seats.take(CELL, A, moving=False)
    since = seats.holder(CELL)
    assert seats.take(CELL, A, moving=True).why_not == ""
    assert seats.holder(CELL) == since
    seats.take(CELL, tablet("a", JON), moving=False)
    assert seats.holder(CELL).who == JON


def test_who_left_it_does_not_free_it_while_the_robot_moves(seats):
    seats.take(CELL, A, moving=False)
    seats.leave(CELL, "b", moving=False)
    assert seats.has(CELL, "a")
    seats.leave(CELL, "a", moving=True)
    assert not seats.has(CELL, "a")
    assert seats.take(CELL, B, moving=None).why_not
    assert seats.take(CELL, A, moving=True).why_not == ""  # its own, as before
    seats.leave(CELL, "a", moving=False)
    assert seats.holder(CELL) is None


def test_a_tablet_without_the_seat_presses_nothing_and_stops(panel):
    mei, jon = panel.browser().load(), panel.browser().load()
    mei.log_in(MEI)
    jon.log_in(JON)
    jon.post("/seat", {"cell": CELL})
    mei.post("/seat", {"cell": CELL})
    assert jon.post("/start", {"cell": CELL}).status == 409
    with jon.live() as stream:
        for frame in ({"t": "press", "number": 1, "action": "start"}, {"t": "hold", "axis": "x+"}):
            refused = stream.ask(press="p", **frame)
            assert refused["t"] == "refused"
            assert MEI in refused["why"]  # who took it
        stream.send(t="beat", finger="f")  # says nothing, ten times a second
        assert stream.ask(t="release", finger="f")["frame"]["t"] == "release"
        assert stream.ask(t="stop", press="s", age_ms=1)["frame"]["press"] == "s"
    assert [frame["t"] for frame in panel.frames] == ["release", "stop"]
    with mei.live("bench") as stream:  # the seat of one cell is none of another
        assert stream.ask(t="press", number=1, action="start")["t"] == "refused"
    with mei.live() as stream:
        assert stream.ask(t="press", number=1, action="start")["t"] == "carried out"


def test_six_pages_of_one_tablet_have_one_seat(panel):
    browser = panel.browser().load()
    browser.log_in()
    browser.post("/seat", {"cell": CELL})
    with browser.live() as one, browser.live() as two, browser.live("") as overview:
        assert one.ask(t="press", number=1, action="take")["t"] == "carried out"
        assert two.ask(t="press", number=1, action="take")["t"] == "carried out"
        assert overview.ask(t="press", number=1, action="take")["t"] == "refused"


def test_frames_that_are_none_end_the_stream(panel):
    browser = panel.browser().load()
    for text in ("", "[]", "1", "{", '{"t": 1, "t": 2}', '{"t": NaN}', "[" * 4000, "x" * 4097):
        with browser.live() as stream:
            stream.socket.send(text)
            assert stream.closed() in (1008, 1009), text[:20]
    with browser.live() as stream:
        stream.socket.send(b'{"t": "stop"}')
        assert stream.closed() == 1008
    assert panel.frames == []


def test_what_is_no_command_is_refused(panel):
    browser = panel.browser().load()
    browser.log_in()
    browser.post("/seat", {"cell": CELL})
    with browser.live() as stream:
        for kind in (
            None,
            "",
            "STOP",
            "view",
            "alive",
            "told",
            "leave",
            ["stop"],
            {"t": "stop"},
            1,
            True,
        ):
            refused = stream.ask(t=kind, press="p" * 300)
            assert refused["t"] == "refused"
            assert len(refused["press"]) == 100
        assert panel.frames == []
        assert stream.ask(t="stop", press="1")["t"] == "carried out"


def test_a_flood_of_presses_is_held_back_and_a_stop_never(panel):
    browser = panel.browser().load()
    browser.log_in()
    browser.post("/seat", {"cell": CELL})
    with browser.live() as stream:
        for number in range(300):
            stream.send(t="press", number=number, action="take", press=str(number))
            if number % 3 == 0:
                stream.send(t="stop", press=f"stop{number}")
        stops, carried_out = 0, 0
        while stops < 100:
            answer = stream.next()
            stops += answer["t"] == "carried out" and answer["frame"]["t"] == "stop"
            carried_out += answer["t"] == "carried out" and answer["frame"]["t"] == "press"
    assert carried_out < 100
    statuses = [browser.post("/tablet", {"dark": True}).status for _ in range(60)]
    assert 429 in statuses
    assert all(browser.post("/stop", {"cell": CELL}).status == 200 for _ in range(60))
