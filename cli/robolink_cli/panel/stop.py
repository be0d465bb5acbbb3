"""STOP from a tablet: carried out at once, once, and whatever else this process is doing.

It is the stop of ``robolink stop`` (:mod:`robolink_cli.stopping`): the process that has the
controller is asked, or the controller itself where nobody has it. A process of its own carries it
out, which has loaded beforehand all that this takes, so that a page that is being made never
delays a stop. Where that process does not take a stop at once, this one carries it out itself.
"""

import asyncio
import contextvars
import json
import os
import subprocess
import sys
import threading
import time
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from enum import StrEnum
from importlib import import_module
from typing import Any, Final

from robolink.messages import tr
from robolink_cli.panel.words import speak_several_languages, speaking_in

OLD_AFTER_MS: Final = 5000.0
"""Age of a press in ms from which it stops nothing: it was meant for what happened then."""

_TAKEN_S: Final = 0.1
"""Longest wait in s for the process that carries stops out to say that it has one."""

_SHARED_S: Final = 1.0
"""For so long in s after a stop has begun, further presses for the same cell wait for its end."""

_MOST_KEPT: Final = 4096
"""Number of presses that are remembered."""

_NEXT_START_S: Final = 0.5
"""Shortest time in s between two starts of that process."""


class StopEnd(StrEnum):
    """What became of a press of STOP."""

    STOPPED = "stopped"
    """The robot was seen at rest after it."""

    NOTHING = "nothing"
    """There was nothing that this could stop."""

    FAILED = "failed"
    """It is not confirmed that the robot has stopped."""

    OLD = "old"
    """The press was too old to be carried out."""


@dataclass(frozen=True, slots=True)
class StopAnswer:
    """What a tablet is told of its press.

    Attributes:
        outcome: What became of it.
        text: That as a sentence, in the tablet's language.
        cells: Which cells it was for.
    """

    outcome: StopEnd
    text: str
    cells: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class StopAsked:
    """One cell that is to be stopped.

    Attributes:
        cell: Its name, or a URL.
        who: Who stops, as the person at the robot is told.
        language: Of the answer.
    """

    cell: str
    who: str
    language: str


CarryOut = Callable[[StopAsked], Awaitable[StopAnswer]]
"""Stops one cell."""


class StopDesk:
    """Takes the presses of STOP of all tablets.

    Args:
        carry_out: Stops one cell; it never raises.
        now_s: A monotonic clock, in seconds.
    """

    def __init__(self, carry_out: CarryOut, now_s: Callable[[], float] = time.monotonic) -> None:
        self._carry_out = carry_out
        self._now_s = now_s
        self._begun_s = now_s()
        self._presses: OrderedDict[tuple[str, str], asyncio.Task[StopAnswer]] = OrderedDict()
        self._under_way: dict[str, tuple[float, asyncio.Task[StopAnswer]]] = {}

    def at_ms(self) -> int:
        """Return this server's time in ms, which a tablet sends back with a press."""
        return round((self._now_s() - self._begun_s) * 1000)

    def age_ms(self, given: object, at_ms: object = None) -> float:
        """Return how old a press is: by the tablet, and by when it last heard this server.

        What cannot be understood counts as fresh: a doubtful STOP stops.

        Args:
            given: The age that the tablet says.
            at_ms: This server's time at the press, as far as the tablet knows it.
        """
        age = _number(given)
        heard = _number(at_ms)
        return max(0.0, age or 0.0, 0.0 if heard is None else self.at_ms() - heard)

    async def press(
        self, press: str, age_ms: float, asked: tuple[StopAsked, ...], *, everywhere: bool = False
    ) -> StopAnswer:
        """Carry a press out, or say what became of it where it was carried out before.

        Args:
            press: Its id.
            age_ms: How long ago the finger came down, in ms.
            asked: What it stops.
            everywhere: Whether it is for all cells of this panel.
        """
        key = ("" if everywhere else asked[0].cell if asked else "", press)
        task = self._presses.get(key)
        if task is None:
            task = asyncio.ensure_future(self._once(age_ms, asked))
            self._presses[key] = task
            while len(self._presses) > _MOST_KEPT:
                self._presses.popitem(last=False)
        # A tablet that goes away takes nothing back.
        return await asyncio.shield(task)

    async def _once(self, age_ms: float, asked: tuple[StopAsked, ...]) -> StopAnswer:
        cells = tuple(one.cell for one in asked)
        language = asked[0].language if asked else ""
        with speaking_in(language):
            if age_ms > OLD_AFTER_MS:
                said = tr(
                    "This STOP reached the panel {seconds:.0f} s after it was pressed and was not "
                    "carried out. Press again.",
                    seconds=age_ms / 1000,
                )
                return StopAnswer(StopEnd.OLD, said, cells)
            if not asked:
                return StopAnswer(StopEnd.NOTHING, tr("This panel runs no job. Nothing to stop."))
        answers = await asyncio.gather(*map(self._stopped, asked))
        if len(answers) == 1:
            return answers[0]
        worst = max((one.outcome for one in answers), key=_SEVERITY.index)
        return StopAnswer(worst, "\n".join(one.text for one in answers), cells)

    async def _stopped(self, asked: StopAsked) -> StopAnswer:
        """Stop one cell; presses that come while that has just begun share its answer."""
        begun = self._under_way.get(asked.cell)
        if begun is not None and not begun[1].done() and self._now_s() - begun[0] < _SHARED_S:
            return await asyncio.shield(begun[1])
        task = asyncio.ensure_future(self._carry_out(asked))
        self._under_way[asked.cell] = (self._now_s(), task)
        return await asyncio.shield(task)


_SEVERITY: Final = (StopEnd.NOTHING, StopEnd.STOPPED, StopEnd.OLD, StopEnd.FAILED)


def _number(given: object) -> float | None:
    if isinstance(given, bool) or not isinstance(given, (int, float)):
        return None
    return float(given) if abs(given) < 1e15 else None


def stop_cell(asked: StopAsked) -> StopAnswer:
    """Stop one cell from this process, and leave the note that keeps others from moving it."""
    from robolink_cli.console.shell_words import state_word
    from robolink_cli.stopping.outcome import Telling
    from robolink_cli.stopping.request import StopRequest
    from robolink_cli.stopping.stop_first import stop_first

    with speaking_in(asked.language):
        request = StopRequest(named=asked.cell, operator=asked.who)
        outcome = stop_first(request)
        telling = Telling(request, outcome)
        with suppress(Exception):  # it explains an error further
            telling.explain_the_holder()
        if outcome.error is None:
            said = tr(
                "{controller}: the robot has stopped (confirmed). State: {state}.",
                controller=asked.cell,
                state=state_word(outcome.state),
            )
            answer = StopAnswer(StopEnd.STOPPED, said, (asked.cell,))
        else:
            text = "\n".join(_told(outcome.error))
            answer = StopAnswer(StopEnd.FAILED, f"{asked.cell}: {text}", (asked.cell,))
        with suppress(Exception):  # the stop has gone out; a record that fails takes nothing back
            telling.remarks()
        return answer


def _told(error: BaseException) -> list[str]:
    what = getattr(error, "what", "") or f"{type(error).__name__}: {error}"
    remedy = getattr(error, "remedy", "")
    return [str(what), *([str(remedy)] if remedy else [])]


class StopProcess:
    """The process that carries stops out; a context manager.

    It is kept ready, and started anew where it has ended.

    Attributes:
        ready: Whether it has loaded what a stop takes.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._number = 0
        self._waiting: dict[int, tuple[threading.Event, asyncio.Future[StopAnswer], Any]] = {}
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False
        self.ready = threading.Event()
        self._listens: threading.Thread | None = None
        self._start()

    def __enter__(self) -> "StopProcess":
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process, after the stops that it carries out."""
        self.close()

    @property
    def pid(self) -> int | None:
        """Number of the process; ``None`` where there is none."""
        return self._process.pid if self._process else None

    def close(self) -> None:
        """End the process, after the stops that it carries out. Idempotent."""
        with self._lock:
            self._closed = True
            process, self._process = self._process, None
        if process is not None and process.stdin is not None:
            with suppress(OSError):
                process.stdin.close()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            if self._listens is not None:
                self._listens.join()

    async def __call__(self, asked: StopAsked) -> StopAnswer:
        """Stop one cell."""
        loop = asyncio.get_running_loop()
        end: asyncio.Future[StopAnswer] = loop.create_future()
        # Threads of its own, never the pool of the loop: that may be full of other work.
        here = contextvars.copy_context()
        threading.Thread(
            target=here.run, args=(self._carry_out, asked, end, loop), name="stop", daemon=True
        ).start()
        return await end

    def _carry_out(
        self,
        asked: StopAsked,
        end: "asyncio.Future[StopAnswer]",
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        if self._handed_over(asked, end, loop):
            return
        try:
            answer = stop_cell(asked)
        except Exception as error:
            answer = StopAnswer(StopEnd.FAILED, "\n".join(_told(error)), (asked.cell,))
        _settle(loop, end, answer)

    def _handed_over(
        self,
        asked: StopAsked,
        end: "asyncio.Future[StopAnswer]",
        loop: asyncio.AbstractEventLoop,
    ) -> bool:
        """Give a stop to the process; return whether it has taken it."""
        taken = threading.Event()
        with self._lock:
            process = self._process
            if process is None or process.stdin is None or not self.ready.is_set():
                return False
            self._number += 1
            number = self._number
            self._waiting[number] = (taken, end, loop)
            try:
                process.stdin.write(
                    json.dumps({"number": number, **asdict(asked)}).encode() + b"\n"
                )
                process.stdin.flush()
            except (OSError, ValueError):
                self._waiting.pop(number)
                return False
        if taken.wait(_TAKEN_S):
            return True
        with self._lock:
            # It may have taken it just now; a stop that is sent twice does no harm.
            self._waiting.pop(number, None)
        return False

    def _start(self) -> None:
        with self._lock:
            if self._closed:
                return
            self._process = process = subprocess.Popen(
                [sys.executable, "-m", __name__],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                start_new_session=os.name != "nt",  # Ctrl-C is for the panel, which then ends it
            )
        self._listens = threading.Thread(
            target=self._listen, args=(process,), name="stops", daemon=True
        )
        self._listens.start()

    def _listen(self, process: "subprocess.Popen[bytes]") -> None:
        began_s = time.monotonic()
        assert process.stdin is not None and process.stdout is not None  # noqa: S101, PT018 - pipes
        with process.stdout:
            for line in process.stdout:
                with suppress(ValueError, KeyError, TypeError):
                    self._heard(json.loads(line))
        with suppress(OSError):
            process.stdin.close()
        process.wait()
        with self._lock:
            lost, self._waiting = self._waiting, {}
            self.ready.clear()
            if self._process is process:
                self._process = None
        for taken, end, loop in lost.values():
            if taken.is_set():
                text = tr("The stop was begun, and nothing was heard of its end.")
                _settle(loop, end, StopAnswer(StopEnd.FAILED, text))
        if not self._closed:
            time.sleep(max(0.0, _NEXT_START_S - (time.monotonic() - began_s)))
        self._start()

    def _heard(self, said: dict[str, Any]) -> None:
        number = said["number"]
        if number == 0:
            self.ready.set()
        with self._lock:
            waiting = self._waiting.get(number)
            if waiting is None:
                return
            if "outcome" in said:
                del self._waiting[number]
        taken, end, loop = waiting
        taken.set()
        if "outcome" in said:
            answer = StopAnswer(StopEnd(said["outcome"]), said["text"], tuple(said["cells"]))
            _settle(loop, end, answer)


def _settle(
    loop: asyncio.AbstractEventLoop, end: "asyncio.Future[StopAnswer]", answer: StopAnswer
) -> None:
    def settle() -> None:
        if not end.done():
            end.set_result(answer)

    with suppress(RuntimeError):  # the loop is over
        loop.call_soon_threadsafe(settle)


_LOADED_BEFORE: Final = (
    "robolink.controllers.epson.rest",
    "robolink.controllers.epson.answers",
    "robolink.controllers.softmotion.wire",
    "robolink.controllers.softmotion.commands",
    "robolink_cli.stopping.notes",
    "robolink_cli.stopping.outcome",
    "robolink_cli.stopping.stop_first",
)
"""All that a stop takes."""

_OVER_OPCUA: Final = (
    "robolink.transport.opcua.mailbox",
    "robolink.transport.opcua.session",
    "robolink.transport.opcua.client",
)
"""What it takes beside that at a PLC over OPC UA: asyncua alone takes 0.5 s of processor time."""


def load_opcua() -> None:
    """Load what a stop over OPC UA takes, where that is installed."""
    with suppress(ImportError):
        for name in _OVER_OPCUA:
            import_module(name)


def main() -> None:
    """Carry out the stops that come on stdin, a JSON line each, until its end."""
    for name in _LOADED_BEFORE:
        import_module(name)
    speak_several_languages()
    running: list[threading.Thread] = []
    tell = threading.Lock()

    def say(said: dict[str, object]) -> None:
        with tell, suppress(OSError, ValueError):
            sys.stdout.write(json.dumps(said) + "\n")
            sys.stdout.flush()

    def carry_out(number: int, asked: StopAsked) -> None:
        try:
            answer = stop_cell(asked)
        except Exception as error:
            answer = StopAnswer(StopEnd.FAILED, "\n".join(_told(error)), (asked.cell,))
        say({"number": number, **asdict(answer)})

    say({"number": 0})
    # Beside the stops of other kinds, which wait for nothing of it.
    threading.Thread(target=load_opcua, name="load OPC UA", daemon=True).start()
    for line in sys.stdin:
        try:
            said = json.loads(line)
            number = said.pop("number")
            asked = StopAsked(**said)
        except (ValueError, KeyError, TypeError):
            continue
        say({"number": number})
        thread = threading.Thread(target=carry_out, args=(number, asked), name="stop")
        thread.start()
        running = [one for one in running if one.is_alive()] + [thread]
    for thread in running:
        thread.join()


if __name__ == "__main__":
    main()
