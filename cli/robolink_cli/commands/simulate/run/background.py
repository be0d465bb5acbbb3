"""--wait-ready: simulators that go on in a process of their own, once all of them listen."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from robolink.errors import ConnectError
from robolink.messages import tr
from robolink_cli.commands.simulate.run.running import SCHEMA
from robolink_cli.console.output import hand_over, show
from robolink_cli.console.render import json_is_on

PARENT: Final = "ROBOLINK_SIM_PARENT"
"""Tells the process whose end it is to wait for."""

_READY: Final = f'{{"schema": "{SCHEMA}"'
_LOOK_S: Final = 0.02
_MOST_S: Final = 120.0


def start_and_wait(arguments: Sequence[str]) -> int:
    """Start ``sim run`` beside this process and hand its first line over.

    Args:
        arguments: Of ``sim run``, without what led here.

    Returns:
        0 when all listen; else the exit code with which it ended, its message shown.

    Raises:
        ConnectError: Nothing came of it for two minutes; it was ended.
    """
    folder = Path(tempfile.mkdtemp(prefix="robolink-sim-log-"))
    log, errors = folder / "log.jsonl", folder / "messages.txt"
    with log.open("wb") as out, errors.open("wb") as messages:
        process = subprocess.Popen(
            [sys.executable, "-m", "robolink_cli", "--json", "sim", "run", *arguments],
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=messages,
            env={**os.environ, PARENT: str(os.getppid())},
            start_new_session=os.name != "nt",
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
        )
    try:
        return _first_line(process, log, errors)
    except BaseException:  # nobody is left behind whose first line nobody has read
        process.kill()
        process.wait()  # killed, so at once; else it stays in the table of processes
        raise


def _first_line(process: "subprocess.Popen[bytes]", log: Path, errors: Path) -> int:
    began_s = time.monotonic()
    while time.monotonic() - began_s < _MOST_S:
        ended = process.poll()
        first, line_end, _ = log.read_text(encoding="utf-8").partition("\n")
        if ended is not None:
            _tell_end(log.read_text(encoding="utf-8"), errors.read_text(encoding="utf-8"))
            shutil.rmtree(log.parent, ignore_errors=True)  # all that stood there was told
            return ended
        if line_end and first.startswith(_READY):
            hand_over(json.dumps({**json.loads(first), "log": str(log)}))
            return 0
        time.sleep(_LOOK_S)
    raise ConnectError(
        tr("The simulators did not listen within {seconds:g} s.", seconds=_MOST_S),
        remedy=tr("What they said meanwhile is in {path}.", path=errors),
    )


def _tell_end(document: str, messages: str) -> None:
    """Tell why nothing is served, as the process would have told it itself."""
    if messages:
        show(messages.rstrip("\n"), beside=True)
    if json_is_on() or not document.startswith("{"):
        hand_over(document.rstrip("\n"))
        return
    *_, last = document.splitlines()  # the line of who listens may stand before it
    error = json.loads(last).get("error")
    if error is not None:  # without one it was told to end, or the system ended it
        show(f"robolink: {error['what']}\n  {error['remedy']}", beside=True)


def parent_of_starter() -> int | None:
    """Return whose end a process started here waits for, ``None`` for who started it."""
    named = os.environ.get(PARENT, "")
    return int(named) if named.isascii() and named.isdigit() else None
