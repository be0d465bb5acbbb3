"""The programs of examples/services, each with simulated cells of both kinds."""

import asyncio
import json
import threading
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import asdict
from pathlib import Path
from runpy import run_path
from typing import Any

import pytest

import robolink
from robolink import ToolOffset
from robolink.errors import StoppedError
from robolink.model import new_operation
from tests._patience import PATIENCE_S

FOLDER = Path(__file__).parents[2] / "examples/services"
KINDS = ("epson", "softmotion")


def example(name: str) -> dict[str, Any]:
    return run_path(str(FOLDER / f"{name}.py"))


def test_each_is_short_enough_to_be_read():
    for path in FOLDER.glob("*.py"):
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 80, path.name


def test_asyncio_shifts_tools_of_two_cells_at_the_same_time(capsys):
    urls = [f"{kind}+sim://{new_operation()}" for kind in KINDS]
    before = []
    for url in urls:
        with robolink.connect(url) as controller:
            before.append([controller.tools.read(tool) or ToolOffset() for tool in (1, 2, 3)])
    asyncio.run(example("asyncio_cells")["main"](urls))
    shown = capsys.readouterr().out
    for url, old in zip(urls, before, strict=True):
        assert url in shown
        with robolink.connect(url) as controller:
            for tool, offset in zip((1, 2, 3), old, strict=True):
                now = controller.tools.read(tool)
                assert now is not None
                assert now.x_mm == pytest.approx(offset.x_mm + 0.1)


def test_asyncio_stops_the_controller_when_the_time_is_over():
    shift_within = example("asyncio_cells")["shift_within"]
    with robolink.connect(f"epson+sim://{new_operation()}", wait_s=PATIENCE_S) as controller:
        held = controller.tools.read(1)
        with controller.procedure("somebody is at work"):
            with pytest.raises(TimeoutError):
                asyncio.run(shift_within(controller, 1, 0.1, 0.05))
        assert controller.latch.closed  # the thread has ended, and nothing follows unasked
        with pytest.raises(StoppedError):
            controller.tools.write(1, ToolOffset(), expected=held)
        assert controller.tools.read(1) == held


# FastAPI without a socket: the service is called as a server would call it.


class Caller:
    """Sends requests to an ASGI application in this process."""

    def __init__(self, app: Any) -> None:
        self._app = app

    async def ask(self, method: str, path: str, body: object = None) -> tuple[int, Any]:
        """Send a request; return status and document."""
        sent = json.dumps(body).encode()
        scope = {
            "type": "http",
            "asgi": {"version": "3.0"},
            "http_version": "1.1",
            "method": method,
            "path": path,
            "raw_path": path.encode(),
            "query_string": b"",
            "headers": [(b"content-type", b"application/json")],
        }
        told: list[dict[str, Any]] = []

        async def receive() -> dict[str, Any]:
            return {"type": "http.request", "body": sent, "more_body": False}

        async def send(message: dict[str, Any]) -> None:
            told.append(message)

        await self._app(scope, receive, send)
        document = b"".join(message.get("body", b"") for message in told)
        return told[0]["status"], json.loads(document)


@asynccontextmanager
async def running(app: Any) -> AsyncIterator[Caller]:
    async with app.router.lifespan_context(app):
        yield Caller(app)


def served(url: str, act: Callable[[Caller, Any], Awaitable[None]]) -> None:
    async def serve() -> None:
        app = example("fastapi_cell")["service"](url)
        async with running(app) as caller:
            await act(caller, app.state.controller)

    asyncio.run(serve())


def plain(x_mm: float) -> dict[str, float]:
    return asdict(ToolOffset(x_mm, -3.5, -20.0))


@pytest.mark.parametrize("kind", KINDS)
def test_twenty_writes_at_once_are_all_done(kind):
    async def act(caller: Caller, controller: robolink.Controller) -> None:
        _, old = await caller.ask("GET", "/tools/1")
        bodies = [{"expected": None, "offset": plain(number)} for number in range(4, 14)]
        writes = [caller.ask("PUT", f"/tools/{n}", body) for n, body in enumerate(bodies, 4)]
        reads = [caller.ask("GET", "/tools/1") for _ in range(10)]
        ends = await asyncio.gather(*writes, *reads)
        assert [status for status, _ in ends] == [200] * 20
        assert [found for _, found in ends[10:]] == [old] * 10
        assert [found["x_mm"] for _, found in ends[:10]] == pytest.approx(list(range(4, 14)))

    served(f"{kind}+sim://{new_operation()}", act)


def test_what_a_write_is_refused_for_is_told_and_a_stop_waits_for_no_thread():
    from anyio.to_thread import current_default_thread_limiter

    async def act(caller: Caller, controller: robolink.Controller) -> None:
        status, said = await caller.ask(
            "PUT", "/tools/4", {"expected": plain(9), "offset": plain(1)}
        )
        assert (status, said["kind"]) == (409, "ToolChangedError")
        assert said["error"]
        assert said["remedy"]
        new = {"expected": None, "offset": plain(1)}
        current_default_thread_limiter().total_tokens = 2
        with controller.procedure("somebody is at work"):
            controller.patience.wait_s = 0.01
            status, said = await caller.ask("PUT", "/tools/4", new)
            assert (status, said["kind"]) == (503, "BusyError")
            controller.patience.wait_s = PATIENCE_S
            writes = [asyncio.ensure_future(caller.ask("PUT", "/tools/4", new)) for _ in range(4)]
            lock = controller._driver.lock  # type: ignore[attr-defined]
            while len(lock._waiting) < 2:  # waiting requests fill the pool of threads
                await asyncio.sleep(0.001)
            assert await caller.ask("POST", "/stop") == (200, "stopped")
            for write in writes:
                status, said = await write
                assert (status, said["kind"]) == (409, "StoppedError")
        assert await caller.ask("POST", "/release") == (200, "released")
        assert (await caller.ask("PUT", "/tools/4", new))[0] == 200
        assert (await caller.ask("GET", "/tools/99"))[0] == 409
        assert (await caller.ask("PUT", "/tools/4", {"offset": {"x_mm": "far"}}))[0] == 422

    served(f"epson+sim://{new_operation()}", act)
    assert threading.active_count() < 20
