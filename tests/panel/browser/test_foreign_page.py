"""A page of another port of this computer, in the browser that also has the panel open.

The gate refuses by what a browser says of a page; here a real one says it.
"""

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from robolink_cli.panel.guard import people

from tests.panel.access._bare import CELL, MEI, PINS, Panel

ATTACK = """
async (panel) => {
  const said = [];
  const tried = async (name, act) => {
    try { said.push([name, await act()]); } catch (error) { said.push([name, "failed"]); }
  };
  const stop = JSON.stringify({cell: "line3", press: "x", age_ms: 1});
  const json = {"Content-Type": "application/json"};
  for (const path of ["/stop", "/stop-all", "/start", "/seat", "/login", "/pair", "/logout"]) {
    const post = {method: "POST", credentials: "include", body: stop};
    await tried("text", async () => (await fetch(panel + path, {...post, mode: "no-cors"})).type);
    await tried("json", async () => (await fetch(panel + path, {...post, headers: json})).status);
    await tried("beacon", async () => navigator.sendBeacon(panel + path, stop));
  }
  await tried("read", async () => (await fetch(panel + "/", {credentials: "include"})).text());
  await tried("script", () => new Promise((done) => {
    const one = document.createElement("script");
    one.onload = () => done("loaded");
    one.onerror = () => done("failed");
    one.src = panel + "/static/panel.js";
    document.head.append(one);
  }));
  await tried("stream", () => new Promise((done) => {
    const one = new WebSocket(panel.replace("http", "ws") + "/live?cell=line3");
    one.onopen = () => done("open");
    one.onerror = () => done("failed");
  }));
  const frame = document.createElement("iframe");
  frame.src = panel + "/";
  document.body.append(frame);
  const form = document.createElement("form");
  form.method = "POST";
  form.enctype = "text/plain";
  form.target = "_blank";
  form.action = panel + "/stop";
  form.innerHTML = `<input name='{"cell":"line3","press":"y","x":"' value='"}'>`;
  document.body.append(form);
  form.submit();
  await new Promise((done) => setTimeout(done, 700));
  return said;
}
"""

OURS = """
async ([path, said, token]) => {
  const headers = {"Content-Type": "application/json", "X-Robolink-Token": token};
  return (await fetch(path, {method: "POST", headers, body: JSON.stringify(said)})).status;
}
"""

LIVES = """
() => new Promise((done) => {
  const one = new WebSocket(`ws://${location.host}/live?cell=line3`);
  one.onmessage = (event) => { done(JSON.parse(event.data).token); one.close(); };
  one.onerror = () => done("");
})
"""


class Evil(BaseHTTPRequestHandler):
    """A page with a link to the panel."""

    panel = ""

    def do_GET(self):
        page = f'<!DOCTYPE html><body><a href="{self.panel}/cell/line3">to the panel</a></body>'
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(page.encode())

    def log_message(self, *_):
        """Say nothing."""


@pytest.fixture
def evil():
    server = ThreadingHTTPServer(("127.0.0.1", 0), Evil)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    thread.join()
    server.server_close()


def test_it_commands_nothing_stops_nothing_and_takes_no_pairing_away(
    tablet, evil, tmp_path, monkeypatch
):
    monkeypatch.setattr(people, "COST", 2)
    panel = Panel(tmp_path)
    panel.set_pins()
    with panel.served():
        address = f"http://127.0.0.1:{panel.port}"
        monkeypatch.setattr(Evil, "panel", address)
        ours = tablet.new_page()
        ours.goto(address + "/")

        def post(path, **said):
            return ours.evaluate(OURS, [path, said, ours.evaluate(LIVES)])

        assert post("/pair", name=MEI, pin=PINS[MEI]) == 200
        assert post("/login", name=MEI, pin=PINS[MEI]) == 200
        assert post("/seat", cell=CELL) == 200
        before = tablet.cookies()
        assert sorted(cookie["sameSite"] for cookie in before) == ["Strict", "Strict"]
        assert all(cookie["httpOnly"] for cookie in before)
        assert ours.evaluate("document.cookie") == ""
        panel.reached.clear()
        panel.frames.clear()

        other = tablet.new_page()
        other.goto(evil)
        said = other.evaluate(ATTACK, address)
        kinds = {name: {str(answer) for kind, answer in said if kind == name} for name, _ in said}
        assert kinds["json"] == {"failed"}  # the browser asked first, and was refused
        assert kinds["read"] == kinds["script"] == kinds["stream"] == {"failed"}
        assert [path for method, path, _ in panel.reached if method == "POST"] == []
        assert panel.frames == []
        refused = panel.notes.whys()
        assert refused.count("origin") > 10
        # Its link opens a page; what the tablet has, it keeps.
        other.goto(evil)
        other.get_by_role("link").click()
        other.wait_for_url(address + "/cell/line3")
        assert _same(tablet.cookies(), before)
        assert post("/start", cell=CELL, job="change") == 200
        assert other.evaluate(LIVES)  # also the page that the link opened


def _same(cookies, before):
    return {one["name"]: one["value"] for one in cookies} == {
        one["name"]: one["value"] for one in before
    }
