"""Guessing a PIN: on a page, in parallel, over restarts, from many addresses, and its file."""

import json
import stat
from concurrent.futures import ThreadPoolExecutor
from typing import cast

import pytest
from robolink_cli.panel.guard import people
from robolink_cli.panel.guard.people import Pins, Tries

from robolink import runtime
from robolink.errors import ConfigError
from robolink.model import PersonRole, Secret
from tests.panel.access._bare import CELL, JON, MEI, OPEN_CELL, PINS, Panel

WRONG = "111222333444"


class Ahead(runtime.SystemRuntime):
    """A wall clock that a test moves."""

    ahead_s = 0.0

    def wall_s(self):
        return super().wall_s() + self.ahead_s


@pytest.fixture
def later():
    ahead = Ahead()
    with runtime.replaced(ahead):
        yield ahead


def test_five_tries_then_a_minute_then_twice_as_long(panel, later):
    browser = panel.browser().load()
    pauses = []
    for _ in range(9):
        answer = browser.log_in(MEI, WRONG)
        while (
            answer.status == 403
            and "PIN" in answer.json()["why"]
            and "again in" not in answer.json()["why"]
        ):
            answer = browser.log_in(MEI, WRONG)
        refused = browser.log_in(MEI)  # also the right one
        assert refused.status == 429
        assert "STOP works" in refused.json()["why"]
        assert not refused.cookies
        pauses.append(int(refused.headers["retry-after"]))
        assert browser.post("/stop", {"cell": CELL, "press": "1"}).status == 200
        later.ahead_s += pauses[-1] + 1
        panel.clock.sleep(60)
    assert [round(pause / 60) for pause in pauses] == [1, 2, 4, 8, 16, 32, 60, 60, 60]
    assert browser.log_in(MEI).status == 200


def test_the_number_of_guesses_in_a_day_is_small(later, tmp_path):
    tries, looked = Tries(tmp_path), 0
    end_s = later.wall_s() + 86_400
    while later.wall_s() < end_s:
        pause_s = tries.pause_s("name mei")
        if pause_s:
            later.ahead_s += pause_s
            continue
        tries.count("name mei")
        looked += 1
    assert looked < 40  # of a million PINs with six digits


def test_a_hundred_at_once_are_looked_at_one_by_one(panel):
    browsers = [panel.browser().load() for _ in range(20)]
    panel.reached.clear()

    def guess(browser):
        return [browser.log_in(MEI, WRONG).status for _ in range(5)]

    with ThreadPoolExecutor(20) as pool:
        statuses = [status for found in pool.map(guess, browsers) for status in found]
    assert statuses.count(403) == 5
    assert set(statuses) <= {403, 429, 503}
    assert browsers[0].log_in(MEI).status == 429


def test_they_count_over_a_restart_and_before_they_are_looked_at(tmp_path, monkeypatch):
    panel = Panel(tmp_path)
    panel.set_pins()
    for _ in range(5):
        with panel.served():
            browser = panel.browser().load()
            # Killed while it looks: the try stands all the same.
            monkeypatch.setattr(panel.access.pins, "matches", None)
            assert browser.log_in(MEI).status == 500
    with panel.served():
        assert panel.browser().load().log_in(MEI).status == 429


def test_what_cannot_be_counted_is_not_looked_at(panel):
    (panel.folder / "tries").write_text("a file where the folder should be")
    answer = panel.browser().load().log_in(MEI)
    assert answer.status in (429, 503)
    assert not answer.cookies


def test_they_count_for_the_person_from_every_address(panel):
    for number in range(5):
        browser = panel.browser(source=f"127.0.0.{number + 2}").load()
        assert browser.log_in(MEI, WRONG).status == 403
    assert panel.browser(source="127.0.0.99").load().log_in(MEI).status == 429
    assert panel.browser(source="127.0.0.99").load().log_in(JON).status == 200


def test_they_count_for_the_address_with_every_name(panel):
    browser = panel.browser(source="127.0.0.7").load()
    for number in range(5):
        assert browser.log_in(f"guess{number}", WRONG).status == 403
    assert browser.log_in(MEI).status == 429
    assert panel.browser().load().log_in(MEI).status == 200


def test_a_name_that_was_only_typed_is_not_on_record_as_who_it_was(panel):
    panel.browser().load().log_in(MEI, WRONG)
    (facts,) = [facts for kind, _, facts in panel.notes.kept if kind == "refused"]
    assert "who" not in facts
    assert (facts["typed_name"], facts["why"]) == (MEI, "pin")
    panel.browser().load().log_in(MEI)
    assert panel.notes.kept[-1][2]["who"] == MEI


def test_an_address_is_not_what_a_header_says(panel):
    for number in range(5):
        headers = {"X-Forwarded-For": f"10.0.0.{number}"}
        said = {"name": MEI, "pin": WRONG}
        assert panel.browser().post("/login", said, **headers).status == 403
    assert panel.notes.kept[-1][2]["address"] == "127.0.0.1"


def test_one_network_is_one_address():
    key = people.address_key
    assert key("2001:db8::1") == key("2001:db8::ffff:1") != key("2001:db8:0:1::1")
    assert key("::ffff:10.0.0.1") == key("10.0.0.1")
    assert key("10.0.0.1") != key("10.0.0.2")


def test_a_clock_set_back_prolongs_no_pause_beyond_its_length(later, tmp_path):
    tries = Tries(tmp_path)
    for _ in range(5):
        tries.count("name mei")
    later.ahead_s = -10_000_000
    assert 0 < tries.pause_s("name mei") <= people.FIRST_PAUSE_S


def test_tries_of_many_addresses_do_not_fill_the_disk(tmp_path, monkeypatch):
    monkeypatch.setattr(people, "_MOST_ADDRESSES", 20)
    tries = Tries(tmp_path)
    for number in range(100):
        tries.count(f"address 10.0.0.{number}")
    assert len(list(tmp_path.iterdir())) <= 21


def test_who_has_no_pin_takes_as_long_as_who_has(tmp_path, monkeypatch):
    pins, made = Pins(tmp_path), []
    pins.set(MEI, Secret(PINS[MEI]))
    scrypt = people._made

    def counted(pin, salt, cost):
        made.append(cost)
        return scrypt(pin, salt, cost)

    monkeypatch.setattr(people, "_made", counted)
    for name, pin in (
        (MEI, PINS[MEI]),
        (MEI, WRONG),
        ("nobody", WRONG),
        (MEI, ""),
        (MEI, "x" * 99),
    ):
        pins.matches(name, pin)
    assert made == [people.COST] * 5


def test_the_stored_pin_is_none(tmp_path, monkeypatch):
    monkeypatch.setattr(people, "COST", 1 << 14)
    pins = Pins(tmp_path / "pins")
    pins.set(MEI, Secret(PINS[MEI]))
    (path,) = (tmp_path / "pins").iterdir()
    assert PINS[MEI] not in path.read_text()
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    assert json.loads(path.read_text())["n"] == 16_384
    assert pins.matches(MEI, PINS[MEI])
    assert not pins.matches(JON, PINS[MEI])
    pins._path(JON).write_bytes(path.read_bytes())  # the file of one is not that of another
    assert not pins.matches(JON, PINS[MEI])


@pytest.mark.parametrize(
    "content", ["", "{}", "[1]", "null", "[" * 9999, '{"schema": "robolink/panel-pin/1"}', "\udcff"]
)
def test_a_damaged_file_lets_nobody_in(tmp_path, content):
    pins = Pins(tmp_path)
    pins.set(MEI, Secret(PINS[MEI]))
    (path,) = tmp_path.iterdir()
    path.write_bytes(content.encode(errors="surrogateescape"))
    assert pins.mark(MEI) == ""
    assert not pins.matches(MEI, PINS[MEI])


@pytest.mark.parametrize(
    "pin",
    [
        "12345",
        "1234567",
        "0000000",
        "9876543",
        "2345678901",
        "12a4567",
        "1234 567",
        "\uff11\uff12\uff13\uff14\uff15\uff16\uff17",
    ],
)
def test_what_is_no_pin_or_the_first_guess_is_not_set(tmp_path, pin):
    with pytest.raises(ConfigError):
        Pins(tmp_path).set(MEI, cast("Secret", _Shown(pin)))
    assert list(tmp_path.iterdir()) == []


class _Shown:
    """A secret that may be shown: it is none."""

    def __init__(self, value):
        self.reveal = lambda: value


def test_a_new_pin_logs_out_whoever_has_the_old_one(panel):
    browser = panel.browser().load()
    assert browser.log_in(MEI).status == 200
    assert browser.post("/seat", {"cell": CELL}).status == 200
    Pins(panel.folder / "pins").set(MEI, Secret("700100900300"))
    assert browser.post("/start", {"cell": CELL, "job": "change"}).status == 403
    Pins(panel.folder / "pins").set(MEI, Secret(PINS[MEI]))
    assert browser.post("/start", {"cell": CELL, "job": "change"}).status == 403
    assert browser.log_in(MEI).status == 200
    assert Pins(panel.folder / "pins").remove(MEI)
    assert browser.post("/start", {"cell": CELL, "job": "change"}).status == 403


def test_a_pin_counts_for_fifteen_minutes(panel):
    browser = panel.browser().load()
    browser.log_in(MEI)
    browser.post("/seat", {"cell": CELL})
    panel.clock.sleep(890)
    assert browser.post("/start", {"cell": CELL}).status == 200
    panel.clock.sleep(20)
    answer = browser.post("/start", {"cell": CELL})
    assert answer.status == 403
    assert "15 minutes" in answer.json()["why"]
    with browser.live() as stream:
        refused = stream.ask(t="press", number=1, action="start", press="p1")
        assert refused["t"] == "refused"
        assert refused["press"] == "p1"
        # A key that is held is not let go because the PIN grew old; none is held from now on.
        assert stream.ask(t="beat", finger="f")["t"] == "carried out"
        assert stream.ask(t="hold", number=1, axis="x+", finger="g")["t"] == "refused"
        # What ends something needs none.
        assert stream.ask(t="press", number=1, action="leave")["t"] == "carried out"
    assert browser.log_in(MEI).status == 200
    assert browser.post("/start", {"cell": CELL}).status == 200


def test_roles_are_those_of_the_cell(panel):
    jon = panel.browser().load()
    assert jon.log_in(JON).status == 200
    tablet_role = panel.access.role
    assert tablet_role(JON, CELL) == "operator"
    assert tablet_role(JON, OPEN_CELL) is None
    assert tablet_role("", CELL) is None
    assert tablet_role("", OPEN_CELL) == "engineer"
    assert tablet_role(MEI, "nowhere") is None
    assert jon.post("/seat", {"cell": OPEN_CELL}).status == 403
    assert jon.post("/seat", {"cell": CELL}).status == 200
    nobody = panel.browser().load()
    assert nobody.log_in("").status == 200
    assert nobody.post("/seat", {"cell": CELL}).status == 403
    assert nobody.post("/seat", {"cell": OPEN_CELL}).status == 200


def test_without_any_pin_all_is_shown_and_a_sentence_says_which_command(tmp_path):
    panel = Panel(tmp_path)
    with panel.served():
        browser = panel.browser().load()
        assert browser.get("/").status == 200
        assert browser.post("/stop", {"cell": CELL, "press": "1"}).status == 200
        for cell, command in ((CELL, "robolink panel pin NAME"), (OPEN_CELL, "robolink panel pin")):
            for path in ("/seat", "/start"):
                answer = browser.post(path, {"cell": cell})
                assert answer.status == 403
                assert answer.json()["why"].endswith(command)
        assert browser.log_in("", "570913482260").status == 403
        assert browser.log_in(MEI, WRONG).status == 403


def test_who_was_taken_from_the_people_is_nobody(tmp_path):
    panel = Panel(tmp_path, people={CELL: {JON: PersonRole.OPERATOR}})
    panel.set_pins()
    with panel.served():
        assert panel.browser().load().log_in(MEI).status == 403
        assert panel.browser().load().log_in("").status == 403
