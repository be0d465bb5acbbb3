"""What a page of somebody else can do, in a browser that also has a page of the panel open."""

from itertools import product

import pytest

from tests.panel.access._bare import CELL, MEI, PINS

POSTS = [
    "/stop",
    "/stop-all",
    "/pair",
    "/login",
    "/logout",
    "/tablet",
    "/seat",
    "/seat/leave",
    "/start",
]


def commanding(panel):
    """Return a browser that may do everything: logged in, with the seat."""
    browser = panel.browser().load()
    assert browser.log_in().status == 200
    assert browser.post("/seat", {"cell": CELL}).status == 200
    assert browser.post("/start", {"cell": CELL, "job": "change"}).status == 200
    panel.reached.clear()
    return browser


FOREIGN = {
    "another site": {"Origin": "https://evil.example", "Sec_Fetch_Site": "cross-site"},
    "another port": {"Origin": "http://127.0.0.1:1", "Sec_Fetch_Site": "same-site"},
    "another name": {"Origin": "http://localhost:{port}", "Sec_Fetch_Site": "same-site"},
    "another scheme": {"Origin": "https://127.0.0.1:{port}", "Sec_Fetch_Site": "cross-site"},
    "nobody's page": {"Origin": "null", "Sec_Fetch_Site": "cross-site"},
    "no origin": {"Origin": None, "Sec_Fetch_Site": "none"},
    "a browser that says it is foreign": {"Sec_Fetch_Site": "cross-site"},
    "two origins": {"Origin": "http://127.0.0.1:{port}, http://127.0.0.1:{port}"},
    "an origin that only begins right": {"Origin": "http://127.0.0.1:{port}.evil.example"},
}


def of(panel, headers):
    return {key: value and value.format(port=panel.port) for key, value in headers.items()}


def test_nothing_that_it_posts_is_carried_out(panel):
    browser = commanding(panel)
    said = {"cell": CELL, "job": "change", "name": MEI, "pin": PINS[MEI], "press": "1"}
    for who, headers in FOREIGN.items():
        for path in POSTS:
            answer = browser.post(path, said, **of(panel, headers))
            assert answer.status == 403, (who, path)
            assert not answer.cookies
    assert panel.reached == []
    assert browser.post("/start", {"cell": CELL, "job": "change"}).status == 200


def test_it_opens_no_stream(panel):
    browser = commanding(panel)
    for who, headers in FOREIGN.items():
        assert browser.refused(**of(panel, headers)) == 403, who
    assert browser.refused() == 101


OTHER_NAMES = [
    "evil.example:{port}",
    "127.0.0.1.evil.example:{port}",
    "127.0.0.1:1",
    "127.0.0.1",
    "127.1:{port}",
    "2130706433:{port}",
    "localhost.:{port}",
    "0.0.0.0:{port}",
]
ODD_NAMES = ["user@127.0.0.1:{port}", "127.0.0.1:{port}:80", "[::1:{port}", "127.0.0.1:{port}/"]


def test_a_name_bent_to_this_address_is_not_answered(panel):
    browser = commanding(panel)
    for name in OTHER_NAMES + ODD_NAMES:
        host = name.format(port=panel.port)
        same = {"Host": host, "Origin": f"http://{host}"}
        answer = browser.post("/stop", {"cell": CELL, "press": "1"}, **same)
        assert answer.status == 421, name
        assert browser.get("/", Host=host).status == 421
        if name in OTHER_NAMES:
            assert browser.refused(**same) == 403
    assert browser.get("/", Host=None).status == 400  # by the server itself
    assert panel.reached == []


def test_two_hosts_are_none(panel):
    import socket

    with socket.create_connection(("127.0.0.1", panel.port), 5) as line:
        line.sendall(
            f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{panel.port}\r\nHost: evil.example\r\n\r\n".encode()
        )
        assert line.recv(100).split()[1] in (b"400", b"421")
    assert panel.reached == []


def test_a_whole_address_in_the_first_line_does_not_take_the_place_of_the_host(panel):
    browser = panel.browser()
    answer = browser.get(f"http://127.0.0.1:{panel.port}/", Host="evil.example")
    assert answer.status == 421


def test_names_are_compared_as_a_browser_writes_them(panel):
    for name in ("localhost", "LOCALHOST", "127.0.0.1", "[::1]"):
        browser = panel.browser(name=name)
        assert browser.get("/").status == 200
        assert browser.post("/stop", {"cell": CELL, "press": "1"}).status == 200


def test_a_link_from_another_site_opens_the_page_and_takes_no_pairing_away(panel):
    browser = panel.browser().load()
    assert browser.pair().status == 200
    paired = dict(browser.jar)
    # SameSite=Strict: the browser leaves our cookies out.
    link = {
        "Sec_Fetch_Site": "cross-site",
        "Sec_Fetch_Mode": "navigate",
        "Sec_Fetch_Dest": "document",
    }
    answer = browser.get("/", Cookie=None, **link)
    assert answer.status == 200
    assert not answer.cookies
    assert browser.jar == paired


def test_it_is_no_part_of_another_page(panel):
    browser = panel.browser()
    for site, what in product(("cross-site", "same-site"), ("script", "image", "iframe", "empty")):
        mode = "navigate" if what == "iframe" else "no-cors"
        answer = browser.get("/", Sec_Fetch_Site=site, Sec_Fetch_Mode=mode, Sec_Fetch_Dest=what)
        assert answer.status == 403
    assert panel.reached == []


def test_every_answer_says_what_a_page_may(panel):
    browser = panel.browser().load()
    answers = [
        browser.get("/"),
        browser.get("/static/panel.js"),
        browser.get("/..%2fx"),
        browser.post("/stop", {"cell": CELL, "press": "1"}),
        browser.post("/nothing"),
        browser.post("/login", {"name": MEI, "pin": "1"}),
        browser.request("DELETE", "/"),
    ]
    assert [answer.status for answer in answers] == [200, 200, 404, 200, 404, 403, 405]
    for answer in answers:
        headers = {key.lower(): value for key, value in answer.headers.items()}
        assert headers["content-security-policy"] == (
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
            "connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'self'"
        )
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["cache-control"] == "no-store"
        assert headers["x-frame-options"] == "DENY"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert not any(key.startswith("access-control") for key in headers)
        assert "server" not in headers


def test_other_methods_reach_nothing(panel):
    browser = commanding(panel)
    for method in ("OPTIONS", "PUT", "DELETE", "PATCH", "TRACE", "CONNECT", "FOO"):
        assert browser.request(method, "/stop").status == 405
    assert panel.reached == []


def test_cookies_cannot_be_read_by_a_script_nor_sent_by_another_site(panel):
    browser = panel.browser()
    said = browser.get("/").cookies
    said += browser.load().pair().cookies
    said += browser.load().log_in().cookies
    assert len(said) >= 3
    for cookie in said:
        parts = [part.strip() for part in cookie.split(";")]
        assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= set(parts)
        assert str(panel.port) in parts[0]  # cookies do not tell ports apart
        assert not any(part.startswith("Domain") for part in parts)


def test_a_proxy_that_makes_everybody_local_is_refused(panel):
    browser = commanding(panel)
    for header in ("X-Forwarded-For", "Forwarded", "Via", "X-Real-IP", "X-Forwarded-Host"):
        proxied = {header: "10.0.0.9"}
        assert browser.get("/", **proxied).status == 403
        assert browser.post("/stop", {"cell": CELL, "press": "1"}, **proxied).status == 403
        assert browser.refused(**proxied) == 403
    assert panel.reached == []


def test_a_message_has_to_be_short_whole_and_json(panel):
    browser = commanding(panel)
    post = lambda body, **more: browser.request("POST", "/stop", body, **more).status  # noqa: E731
    assert post(b'{"cell": "' + b"x" * 4096 + b'"}') == 413
    assert post(b"", Content_Length="99999999999") == 413
    assert post(b"[]") == 400
    assert post(b"{") == 400
    assert post(b"\xff\xfe") == 400
    assert post(b'{"cell": 1, "cell": 2}') == 400
    assert post(b'{"cell": NaN}') == 400
    assert post(b"[" * 4000) == 400
    assert post(b"cell=line3", Content_Type="application/x-www-form-urlencoded") == 415
    assert post(b'{"cell": "line3"}', Content_Type="text/plain") == 415
    assert post(b'{"cell": "line3"}', Content_Type=None) == 415
    assert browser.post("/stop?cell=line3", {"cell": CELL}).status == 415
    assert panel.reached == []
    assert post(b'{"cell": "line3"}') == 200


def test_a_page_without_its_token_commands_nothing_and_stops_all_the_same(panel):
    browser = commanding(panel)
    for token in (None, "0" * 64, browser.token.upper(), browser.token + " x"):
        for path in ("/start", "/seat", "/seat/leave", "/tablet", "/logout"):
            answer = browser.post(path, {"cell": CELL, "job": "change"}, X_Robolink_Token=token)
            assert answer.status == 403
        assert panel.reached == []
        assert browser.post("/stop", {"cell": CELL}, X_Robolink_Token=token).status == 200
        panel.reached.clear()
        panel.clock.sleep(1)  # twenty commands a second


def test_the_token_of_another_browser_is_none(panel):
    browser, other = commanding(panel), panel.browser().load()
    answer = browser.post("/start", {"cell": CELL}, X_Robolink_Token=other.token)
    assert answer.status == 403


def test_what_stands_in_no_table_cannot_be_posted(panel):
    browser = commanding(panel)
    for path in (
        "/",
        "/cell/line3",
        "/reset",
        "/release",
        "/live",
        "/stop/",
        "/STOP",
        "/stop;x",
        "//stop",
    ):
        assert browser.post(path, {"cell": CELL}).status == 404
    assert panel.reached == []


def test_only_live_is_a_stream(panel):
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect
    from websockets.typing import Origin

    browser = commanding(panel)
    for path in ("/", "/stop", "/live/", "/live2"):
        with pytest.raises(InvalidStatus) as refused:
            with connect(f"ws://{browser.host}{path}", origin=Origin(f"http://{browser.host}")):
                pass
        assert refused.value.response.status_code == 403
