"""A panel with a plant's database, served in a thread on a real socket, and who asks it."""

import asyncio
import http.client
import json
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from robolink_cli.panel.board import PanelCell
from robolink_cli.panel.guard.line_tokens import LineToken, LineTokens
from robolink_cli.panel.plant.plan_watch import PlantSight, PlanWatch
from robolink_cli.panel.serving import PanelPlace, Served, serve

from robolink.config import load_cell_files
from robolink.model import PersonRole

MEI, JON = "mei", "jon"
PEOPLE = {MEI: PersonRole.ENGINEER, JON: PersonRole.OPERATOR}
EVERY_KIND = ("backup", "check", "drift", "recipe", "offset", "nozzle_change")


class PlantPanel:
    """A served panel.

    Attributes:
        port: Where it listens.
        kept: What went on record.
    """

    def __init__(self):
        self.port, self.kept, self._watches = 0, [], []
        self._loop: Any = None

    def forget(self):
        """Forget what was heard of plans; a look under way ends before."""
        for watch in self._watches:
            last = watch._desk.ask(lambda _store, _confirm: None, 60)
            asyncio.run_coroutine_threadsafe(last, self._loop).result(60)
            watch.sight = PlantSight()
            watch.look_again()

    def note(self, kind, cell, **facts):
        self.kept.append((kind, cell, facts))

    @contextmanager
    def served(self, names, groups=None, people=None):
        ready, loop_of = threading.Event(), list[Any]()
        files = load_cell_files().cells if Path("robolink.toml").exists() else {}

        async def run():
            ended = asyncio.Event()
            self._loop = asyncio.get_running_loop()
            loop_of.extend((self._loop, ended))

            def told(url):
                self.port = int(url.rstrip("/").rpartition(":")[2])
                ready.set()

            url = "epson+tcp://127.0.0.1:9"  # nobody listens there
            cells = tuple(PanelCell(name, url, configured=files.get(name)) for name in names)
            who = dict.fromkeys(names, PEOPLE) | (people or {})
            served = Served(cells, who, audit=self, groups=groups or {})
            await serve(served, PanelPlace("127.0.0.1", 0), ready=told, ended=ended)

        def watching(*given):
            self._watches.append(PlanWatch(*given))
            return self._watches[-1]

        thread = threading.Thread(target=lambda: asyncio.run(run()))
        try:
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr("robolink_cli.panel.app.PlanWatch", watching)
                thread.start()
                assert ready.wait(180)
            yield self
        finally:
            if loop_of:
                loop_of[0].call_soon_threadsafe(loop_of[1].set)
            thread.join(20)
        assert not thread.is_alive()


def token_of(
    name="mes", *, kinds=EVERY_KIND, cells=("*",), until="2099-01-01T00:00:00+00:00", permit=""
):
    """Keep a token; return its secret."""
    made = LineToken(name, tuple(kinds), tuple(cells), until, "plant", "Li", "2026-11-30", permit)
    return LineTokens().give(made, replace=True).reveal()


class LineComputer:
    """A program that orders jobs.

    Args:
        port: Of the panel.
        token: Its token; empty for none.
        source: From which address it asks.
    """

    def __init__(self, port, token="", source="127.0.0.1"):
        self.port, self.token, self.source = port, token, source

    def ask(self, method, path, body=b"", **changed):
        """Ask; a header that is ``None`` is left out. Return status, document, headers."""
        headers = {
            "Host": f"127.0.0.1:{self.port}",
            "Authorization": f"Bearer {self.token}" if self.token else None,
            "Content-Type": "application/json" if method == "POST" else None,
        } | {key.replace("_", "-"): value for key, value in changed.items()}
        line = http.client.HTTPConnection(
            "127.0.0.1", self.port, timeout=20, source_address=(self.source, 0)
        )
        try:
            line.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for key, value in headers.items():
                if value is not None:
                    line.putheader(key, value)
            if method == "POST":
                line.putheader("Content-Length", str(len(body)))
            line.endheaders(body)
            answer = line.getresponse()
            data = answer.read()
        finally:
            line.close()
        kept = {name.lower(): value for name, value in answer.getheaders()}
        return answer.status, json.loads(data or b"{}"), kept

    def post(self, said, **changed):
        return self.ask("POST", "/jobs", json.dumps(said).encode(), **changed)

    def get(self, order):
        from urllib.parse import quote

        return self.ask("GET", f"/jobs/{quote(order, safe='')}")
