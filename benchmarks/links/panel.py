"""The panel with twenty tablets: a change to the page, STOP to the Abort frame, memory, processor.

The job shows something else ten times a second; robot, panel and job are processes of their own, as
on a line computer. The floor sends the same bytes to as many bare WebSockets.
"""

import asyncio
import http.client
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import AsyncExitStack, ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median, quantiles
from typing import Any, Final

import websockets

from benchmarks.links.panel_ends import EVERY_S, MOVING, URL
from benchmarks.table import Amount, Figure

TABLETS: Final = 20
STOPS: Final = 100
_LOOK_S: Final = 5.0
_PIN: Final = "41827364"
_ENDS: Final = "benchmarks.links.panel_ends"


def measure_panel() -> Iterator[Figure]:
    """Yield the figures."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        environment = {**os.environ, "ROBOLINK_STATE_DIR": str(folder / "state")}
        root = str(Path(__file__).parents[2])
        environment["PYTHONPATH"] = os.pathsep.join([root, *sys.path])
        robot = stack.enter_context(_started(["robot"], environment))
        assert robot.stdout is not None  # noqa: S101 - it was asked for
        url = robot.stdout.readline().decode().strip()
        (folder / "robolink.toml").write_text(f'[cells.line3]\nurl = "{url}"\n')
        _set_pin(folder)
        arguments = ["--json", "panel", "--cells", str(folder / "robolink.toml")]
        panel = stack.enter_context(
            _started(["panel", *arguments, "--listen", "127.0.0.1:0"], {**environment, URL: url})
        )
        assert panel.stdout is not None  # noqa: S101 - likewise
        port = int(json.loads(panel.stdout.readline())["url"].rstrip("/").rpartition(":")[2])
        seen = asyncio.run(_watched(port, panel.pid, robot))
    floor_ms = asyncio.run(_floor(seen.length))
    yield Figure(
        f"a change of a job to the page, {TABLETS} tablets, median",
        Amount(median(seen.late_ms), "ms"),
        f"a bare WebSocket to {TABLETS}",
        Amount(median(floor_ms), "ms"),
        median(seen.late_ms) / median(floor_ms),
    )
    yield Figure(
        "the same, 99 of 100",
        Amount(_of_100(seen.late_ms, 99), "ms"),
        f"a bare WebSocket to {TABLETS}",
        Amount(_of_100(floor_ms, 99), "ms"),
        _of_100(seen.late_ms, 99) / _of_100(floor_ms, 99),
    )
    wanted = Amount(60.0, "ms")
    yield Figure(
        f"STOP to the Abort frame, robot moving, {TABLETS} tablets watching, median of {STOPS}",
        Amount(median(seen.stop_ms), "ms"),
    )
    late_ms = _of_100(seen.stop_ms, 99)
    yield Figure("the same, 99 of 100", Amount(late_ms, "ms"), "wanted", wanted, late_ms / 60, 1.0)
    yield Figure("memory of the panel, a tablet", Amount(seen.memory_kb, "kB"))
    yield Figure("memory of the panel, none", Amount(seen.before_kb / 1024, "MB"))
    yield Figure(
        f"processor of the panel at {1 / EVERY_S:.0f} views a second, {TABLETS} tablets",
        Amount(seen.processor_percent, "%"),
    )


@dataclass
class _Seen:
    late_ms: list[float] = field(default_factory=list)
    stop_ms: list[float] = field(default_factory=list)
    memory_kb: float = 0.0
    before_kb: float = 0.0
    processor_percent: float = 0.0
    length: int = 0
    moving: bool = False


class _Tablet:
    """A browser's part of a request: its cookies, and the token of its page."""

    def __init__(self, port: int) -> None:
        self.port, self.cookies, self.token = port, dict[str, str](), ""
        self.ask("GET", "/")

    def ask(self, method: str, path: str, said: object = None) -> int:
        """Return the status of an answer."""
        origin = f"http://127.0.0.1:{self.port}"
        headers = {"Cookie": self.cookie, "Sec-Fetch-Site": "same-origin", "Origin": origin}
        headers |= {"Content-Type": "application/json", "X-Robolink-Token": self.token}
        line = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        line.request(method, path, None if said is None else json.dumps(said), headers)
        answer = line.getresponse()
        answer.read()
        for text in answer.headers.get_all("set-cookie", []):
            name, _, value = text.partition(";")[0].partition("=")
            self.cookies[name] = value
        line.close()
        return answer.status

    @property
    def cookie(self) -> str:
        """The header of its cookies."""
        return "; ".join(f"{name}={value}" for name, value in self.cookies.items())

    async def opened(self, stack: AsyncExitStack) -> Any:  # noqa: ANN401 - of websockets
        """Open a page's stream until a stack is closed; take the token."""
        line = await stack.enter_async_context(
            websockets.connect(
                f"ws://127.0.0.1:{self.port}/live?cell=line3",
                origin=f"http://127.0.0.1:{self.port}",  # type: ignore[arg-type]
                additional_headers={"Cookie": self.cookie},
            )
        )
        self.token = json.loads(await line.recv())["token"]
        return line


async def _watched(port: int, pid: int, robot: "subprocess.Popen[bytes]") -> _Seen:
    seen = _Seen()
    async with AsyncExitStack() as stack:
        boss = _Tablet(port)
        assert boss.ask("POST", "/login", {"name": "", "pin": _PIN}) == 200  # noqa: S101
        line = await boss.opened(stack)
        tasks = [asyncio.ensure_future(_follow(line, seen))]
        assert boss.ask("POST", "/seat", {"cell": "line3"}) == 200  # noqa: S101
        assert boss.ask("POST", "/start", {"cell": "line3", "job": "change"}) == 200  # noqa: S101
        while not seen.late_ms:
            await asyncio.sleep(0.05)
        await asyncio.sleep(1.0)
        seen.before_kb = _memory_kb(pid)
        for _ in range(TABLETS - 1):
            tasks.append(asyncio.ensure_future(_follow(await _Tablet(port).opened(stack), seen)))
        await asyncio.sleep(1.0)
        seen.late_ms.clear()
        began_s, used_s = time.perf_counter(), _used_s(pid)
        await asyncio.sleep(_LOOK_S)
        took_s = time.perf_counter() - began_s
        seen.processor_percent = 100 * (_used_s(pid) - used_s) / took_s
        seen.memory_kb = (_memory_kb(pid) - seen.before_kb) / (TABLETS - 1)
        late_ms = list(seen.late_ms)
        assert robot.stdout is not None  # noqa: S101 - it was asked for
        for number in range(STOPS):
            while not seen.moving:
                await asyncio.sleep(0.01)
            await asyncio.sleep(0.03)
            began_ns = time.perf_counter_ns()
            stop = {"t": "stop", "press": f"b{number}", "age_ms": 0}
            await line.send(json.dumps(stop))
            at_ns = int(await asyncio.to_thread(robot.stdout.readline))
            seen.stop_ms.append((at_ns - began_ns) / 1e6)
            await asyncio.sleep(0.3)
            seen.moving = False
        seen.late_ms = late_ms
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    return seen


async def _follow(line: Any, seen: _Seen) -> None:  # noqa: ANN401 - of websockets
    """Answer beats, and note how late each change is."""
    with suppress(websockets.ConnectionClosed):
        async for text in line:
            now_ns = time.perf_counter_ns()
            if '"t":"beat"' in text:
                await line.send('{"t":"pong"}')
            elif made := re.search(r"<span>(\d{12,})</span>", text):
                seen.late_ms.append((now_ns - int(made[1])) / 1e6)
                seen.length = len(text)
                seen.moving = MOVING in text


async def _floor(length: int) -> list[float]:
    """Return how late so many bytes are at bare WebSockets, in ms."""
    late_ms: list[float] = []
    code = (
        "import asyncio, sys, time, websockets\n"
        "lines = set()\n"
        "async def serve(line):\n"
        "    lines.add(line)\n"
        "    await line.wait_closed()\n"
        "async def main():\n"
        "    async with websockets.serve(serve, '127.0.0.1', 0, compression=None) as server:\n"
        "        print(server.sockets[0].getsockname()[1], flush=True)\n"
        "        while True:\n"
        f"            await asyncio.sleep({EVERY_S})\n"
        f"            text = str(time.perf_counter_ns()).ljust({length})\n"
        "            websockets.broadcast(lines, text)\n"
        "asyncio.run(main())\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None  # noqa: S101 - it was asked for
        port = int(process.stdout.readline())

        async def follow(line: Any) -> None:  # noqa: ANN401 - of websockets
            async for text in line:
                late_ms.append((time.perf_counter_ns() - int(text.strip())) / 1e6)

        async with AsyncExitStack() as stack:
            lines = [
                await stack.enter_async_context(websockets.connect(f"ws://127.0.0.1:{port}"))
                for _ in range(TABLETS)
            ]
            tasks = [asyncio.ensure_future(follow(line)) for line in lines]
            await asyncio.sleep(_LOOK_S)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
    finally:
        process.kill()
        process.wait()
    return late_ms


def _of_100(values: list[float], rank: int) -> float:
    return quantiles(values, n=100)[rank - 1]


def _set_pin(folder: Path) -> None:
    from robolink_cli.panel.guard.people import NOBODY, Pins

    from robolink.model import Secret

    Pins(folder / "state" / "panel" / "pins").set(NOBODY, Secret(_PIN))


def _started(arguments: list[str], environment: dict[str, str]) -> Any:  # noqa: ANN401
    """Start one of the ends; it is killed when the block ends."""
    process = subprocess.Popen(
        [sys.executable, "-m", _ENDS, *arguments], stdout=subprocess.PIPE, env=environment
    )
    return _Killed(process)


class _Killed:
    def __init__(self, process: "subprocess.Popen[bytes]") -> None:
        self._process = process

    def __enter__(self) -> "subprocess.Popen[bytes]":
        return self._process

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(15)
        self._process.kill()
        self._process.wait()


def _memory_kb(pid: int) -> float:
    text = Path(f"/proc/{pid}/status").read_text()
    return float(text.partition("VmRSS:")[2].split()[0])


def _used_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
