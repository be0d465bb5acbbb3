"""Tablets on the LAN: what one sees before it is paired, and what pairing is worth afterwards."""

import stat

import pytest
from robolink_cli.panel.guard.pairing import PairedTablets, tablet_id

from robolink.errors import ConfigError
from tests.panel.access._bare import CELL, JON, MEI, Panel


def far(panel):
    return panel.browser(name="cell.shop")


def test_before_it_is_paired_a_tablet_sees_how_to_pair_and_nothing_else(far_panel):
    browser = far(far_panel)
    for path in ("/", "/cell/line3", "/cell/line3/history", "/login", "/staticx", "/pairs"):
        answer = browser.get(path)
        if path == "/pairs":
            continue
        assert (answer.status, answer.headers.get("location")) == (303, "/pair"), path
    assert far_panel.reached in ([], [("GET", "/pairs", b"")])
    assert browser.get("/pair").status == 200
    assert browser.get("/static/panel.js").status == 200
    far_panel.reached.clear()
    for path in ("/stop", "/stop-all", "/login", "/logout", "/tablet", "/seat", "/start"):
        said = {"cell": CELL, "name": MEI, "pin": "204060718293", "press": "1"}
        assert browser.post(path, said).status == 403
    assert browser.refused() == 403
    assert far_panel.reached == []


def test_it_is_paired_once_by_an_engineer(far_panel):
    browser = far(far_panel)
    refused = browser.pair(JON)
    assert refused.status == 403
    assert "engineer" in refused.json()["why"]
    assert browser.get("/").status == 303
    assert browser.pair(MEI).status == 200
    assert browser.get("/").status == 200
    assert browser.post("/stop", {"cell": CELL, "press": "1"}).status == 200
    assert browser.refused() == 101
    (path,) = (far_panel.folder / "tablets").iterdir()
    (secret,) = [value for key, value in browser.jar.items() if "tablet" in key]
    assert secret not in path.read_text() + path.name
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_who_guesses_outside_makes_nobody_wait_at_a_paired_tablet(far_panel):
    inside = far(far_panel)
    inside.pair()
    inside.load()
    for number in range(5):
        outside = far_panel.browser(name="cell.shop", source=f"127.0.0.{number + 9}")
        assert outside.pair(MEI, "111222333444").status == 403
    outside = far_panel.browser(name="cell.shop", source="127.0.0.99")
    assert outside.pair(MEI).status == 429
    assert inside.log_in(MEI).status == 200
    for _ in range(5):
        assert inside.log_in(MEI, "111222333444").status == 403
    assert inside.log_in(MEI).status == 429


def test_stop_needs_only_the_pairing_also_after_a_restart(tmp_path):
    panel = Panel(tmp_path, host="0.0.0.0", names=("cell.shop",))
    panel.set_pins()
    with panel.served():
        port, browser = panel.port, far(panel)
        browser.pair()
        browser.load().log_in()
        browser.post("/seat", {"cell": CELL})
        stale = browser.token
    with panel.served(port):
        browser.token = stale
        assert browser.post("/stop", {"cell": CELL, "press": "1"}).status == 200
        assert browser.post("/stop", {"cell": CELL}, X_Robolink_Token=None).status == 200
        assert browser.post("/start", {"cell": CELL}).status == 403
        with browser.live() as stream:
            assert stream.ask(t="stop", press="2", age_ms=5)["t"] == "carried out"
            assert stream.ask(t="press", number=1, action="start")["t"] == "refused"
        # An old browser does not say Sec-Fetch-Site; its STOP counts, nothing else does.
        browser.load()
        old = {"Sec_Fetch_Site": None}
        assert browser.post("/stop", {"cell": CELL, "press": "3"}, **old).status == 200
        assert browser.post("/tablet", {"dark": True}, **old).status == 403


def test_a_guessed_secret_is_none(far_panel):
    browser = far(far_panel)
    browser.pair()
    ((key, secret),) = [pair for pair in browser.jar.items() if "tablet" in pair[0]]
    thief = far(far_panel)
    for value in ("0" * 64, secret[:-1], secret.upper(), tablet_id(secret), "../" + secret, ""):
        thief.jar = {key: value}
        assert thief.get("/").status == 303, value
        assert thief.post("/stop", {"cell": CELL}).status == 403


def test_a_cookie_planted_from_another_port_takes_no_pairing_away(far_panel):
    browser = far(far_panel)
    browser.pair()
    ((key, secret),) = [pair for pair in browser.jar.items() if "tablet" in pair[0]]
    for planted in ("0" * 64, "x", ""):
        for cookies in (f"{key}={planted}; {key}={secret}", f"{key}={secret}; {key}={planted}"):
            answer = browser.post("/stop", {"cell": CELL}, Cookie=cookies)
            assert answer.status == 200


def test_who_planted_the_tablets_cookie_does_not_share_the_login(panel):
    victim, thief = panel.browser().load(), panel.browser()
    thief.jar = dict(victim.jar)
    thief.load()
    assert victim.log_in().status == 200
    assert victim.post("/seat", {"cell": CELL}).status == 200
    assert victim.post("/start", {"cell": CELL}).status == 200
    assert thief.post("/start", {"cell": CELL}).status == 403
    with thief.live() as stream:
        assert stream.ask(t="press", number=1, action="start")["t"] == "refused"


def test_the_cookie_of_a_login_is_worth_nothing_on_another_tablet(panel):
    victim, thief = panel.browser().load(), panel.browser().load()
    victim.log_in()
    thief.jar |= {key: value for key, value in victim.jar.items() if "login" in key}
    assert thief.post("/seat", {"cell": CELL}).status == 403
    assert victim.post("/seat", {"cell": CELL}).status == 200


def test_a_tablet_that_was_removed_stops_nothing_by_the_stream_that_it_still_has(far_panel):
    browser = far(far_panel)
    browser.pair()
    with browser.live() as stream:
        assert stream.ask(t="stop", press="1")["t"] == "carried out"
        (tablet,) = far_panel.access.tablets.all()
        far_panel.access.tablets.forget(tablet.id)
        stream.send(t="stop", press="2")
        assert stream.closed() == 4003
    assert [frame["press"] for frame in far_panel.frames] == ["1"]


def test_pairing_draws_a_new_secret(panel):
    browser = panel.browser().load()
    before = dict(browser.jar)
    browser.pair()
    assert {key: browser.jar[key] for key in before} != before
    old = panel.browser()
    old.jar = before
    assert not panel.access.tablets.holds(tablet_id(next(iter(before.values()))))


def test_a_tablet_that_is_removed_is_cut_off_at_once(far_panel):
    browser = far(far_panel)
    browser.pair()
    with browser.live() as stream:
        (tablet,) = PairedTablets(far_panel.folder / "tablets").all()
        assert tablet.by == MEI
        with pytest.raises(ConfigError):
            far_panel.access.tablets.forget("")
        with pytest.raises(ConfigError):
            far_panel.access.tablets.forget("zz")
        PairedTablets(far_panel.folder / "tablets").forget(tablet.id)
        stream.send(t="pong")
        assert stream.closed() == 4003
    assert browser.get("/").status == 303
    assert browser.post("/stop", {"cell": CELL}).status == 403
    assert browser.refused() == 403


def test_names_of_a_certificate_and_no_others(far_panel):
    for name, status in (
        ("cell.shop", 303),
        ("a.line.shop", 303),
        ("line.shop", 421),
        ("a.b.line.shop", 421),
        ("shop", 421),
        ("localhost", 421),
        ("0.0.0.0", 421),
    ):
        assert far_panel.browser(name=name).get("/").status == status, name


def test_with_tls_a_cookie_is_of_this_host_alone(tmp_path):
    panel = Panel(tmp_path, host="0.0.0.0", tls=True, names=("cell.shop",))
    with panel.served():
        cookie = panel.access.cookie("login", "x")
        assert cookie.startswith("__Host-")
        assert "; Secure" in cookie
        assert "Domain" not in cookie


def test_logging_in_out_or_pairing_makes_the_streams_anew(panel):
    browser = panel.browser().load()
    with browser.live() as stream:
        assert browser.log_in().status == 200
        assert stream.closed() == 4001
    browser.post("/seat", {"cell": CELL})
    with browser.live() as stream:
        assert stream.ask(t="press", number=1, action="start")["t"] == "carried out"
        assert browser.post("/logout").status == 200
        assert stream.closed() == 4001
    with browser.live() as stream:
        assert stream.ask(t="press", number=1, action="start")["t"] == "refused"
    assert browser.post("/start", {"cell": CELL}).status == 403


def test_a_login_that_was_ended_does_not_come_back_with_its_cookie(panel):
    browser = panel.browser().load()
    browser.log_in()
    kept = dict(browser.jar)
    assert browser.post("/logout").status == 200
    browser.jar = dict(kept)
    assert browser.post("/seat", {"cell": CELL}).status == 403
    # Nor does one that another has followed.
    browser.log_in()
    kept = dict(browser.jar)
    browser.log_in(JON)
    browser.jar = dict(kept)
    assert browser.post("/seat", {"cell": CELL}).status == 403
