"""Starts ``python -m robolink_cli`` by forking a process that has already imported it.

Imports took two of the three seconds of a command that a test starts. A forked command is still a
process of its own: a child of the test's process, with its own number, descriptors, signals,
session and environment, and it ends as any Python process does. Only the start of the interpreter
is not tested this way; tests of the start use ``-c``. A new Python is started where the interpreter
would begin differently (other ``PYTHON`` variables or locale), and on other systems than Linux.

A panel starts processes too: those that stop, look, and do a job. Before it does anything else it
therefore leaves a copy of itself that is forked for each of them, and which ends with it. That copy
has no threads, while a panel has some.
"""

import atexit
import ctypes
import gc
import io
import json
import os
import pkgutil
import runpy
import signal
import socket
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from typing import Any, Final, NoReturn

_BECOME_PARENT_OF_ORPHANS: Final = 36  # PR_SET_CHILD_SUBREAPER
_LONGEST: Final = 1 << 20
_NAME_OF_A_PROCESS: Final = 15  # PR_SET_NAME
_PROGRAMS: Final = (
    "robolink_cli",
    "robolink_cli.job_process",
    "robolink_cli.panel.stop",
    "tests.contract._own_window",
    "benchmarks.work.asked_cells",
    "tests._program",
    "tests.fleet._full_disk",
    "tests.fleet._killed_next",
)
_STARTS_OTHERS: Final = "panel"
"""The command that leaves a copy of itself to be forked."""
NAME: Final = "warm-process"
"""The name of such a copy in ``/proc/PID/comm``: it is no process of the panel."""
_READ_LATER: Final = ("PYTHONPATH", "PYTHONIOENCODING", "PYTHON_KEYRING_BACKEND")
"""Variables that a forked command obeys too."""
_PACKAGES: Final = (
    "robolink_cli",
    "robolink_simulators.epson",
    "robolink_simulators.softmotion",
    "robolink.controllers",
    "robolink.journal",
)
"""Their modules are all imported."""
_LOADED_LATE: Final = (
    "robolink.fleet.agent",
    "platformdirs",
    "rich.table",
    "encodings.idna",
    "uvicorn.lifespan.on",
    "uvicorn.protocols.http.auto",
    "uvicorn.protocols.websockets.auto",
)
"""What commands import only when they need it, and most that tests start do."""
_FREE_FROM: Final = 200
"""Descriptors from here on are nobody's in a process that was just forked."""
_started: dict[int, "_WarmProcess"] = {}


def install() -> None:
    """Fork every command that this process starts from now on, where possible."""
    if sys.platform != "linux":
        return
    usual: Any = subprocess.Popen._execute_child  # type: ignore[attr-defined]

    def execute(popen: Any, *given: Any) -> None:
        args, executable, before, closes, kept, cwd, env, _, _, shell = given[:10]
        pipes, (*_, umask, new_session, group) = given[10:16], given[16:]
        environment = dict(os.environ if env is None else env)
        words = [] if isinstance(args, str | bytes | os.PathLike) else list(map(os.fspath, args))
        if (
            words[:2] != [sys.executable, "-m"]
            or words[2] not in _PROGRAMS
            or (executable, before, closes, shell) != (None, None, True, False)
            or (umask, group) != (-1, -1)
            or (warm := _warm(environment)) is None
        ):
            usual(popen, *given)
            return
        ends = [own if end == -1 else end for own, end in enumerate((pipes[0], *pipes[3::2]))]
        where = os.getcwd() if cwd is None else os.fspath(cwd)
        popen.pid = warm.fork(words[2:], where, environment, new_session, ends, kept)
        popen._child_created = True
        popen._close_pipe_fds(*pipes)

    subprocess.Popen._execute_child = execute  # type: ignore[attr-defined]


def end() -> None:
    """End the process that is forked, so that its CPU time is counted."""
    if (warm := _started.pop(os.getpid(), None)) is not None:
        warm.end()


def _warm(environment: dict[str, str]) -> "_WarmProcess | None":
    """Return the process to fork if a new Python would begin the same way in this environment."""
    warm = _started.get(os.getpid())
    if warm is None:
        warm = _started[os.getpid()] = _WarmProcess()
    return warm if warm.begins_as(environment) else None


class _WarmProcess:
    """A process that has imported the command and waits to be forked."""

    def __init__(self, *, copied: bool = False) -> None:
        """Start it; ``copied`` makes it of this process, which has no threads yet."""
        self._own, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        path = os.pathsep.join(path for path in sys.path if path)
        environment = {**os.environ, "PYTHONPATH": path}
        self._begun = _of_the_beginning(environment)
        self._path = {"", os.getcwd(), *sys.path}
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        if copied:
            if os.fork() == 0:
                self._own.close()
                _be_a_copy(far)
            far.close()
            return
        with far:
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__, str(far.fileno())],
                env=environment,
                pass_fds=[far.fileno()],
                stdin=subprocess.DEVNULL,
            )

    def begins_as(self, environment: dict[str, str]) -> bool:
        """Whether a new Python with this environment would begin as this one did."""
        path = environment.get("PYTHONPATH", "").split(os.pathsep)
        return _of_the_beginning(environment) == self._begun and self._path.issuperset(path)

    def fork(
        self,
        words: list[str],
        cwd: str,
        env: dict[str, str],
        new_session: bool,
        ends: list[int],
        kept: Sequence[int],
    ) -> int:
        """Start a command; return its process number. The process is a child of this one."""
        asked = json.dumps([os.getpid(), words, cwd, env, new_session, list(kept)]).encode()
        assert len(asked) < _LONGEST
        with self._lock:
            _take_orphans(True)
            try:
                socket.send_fds(self._own, [asked], [*ends, *kept])
                return int(self._own.recv(64))
            finally:
                _take_orphans(False)

    def end(self) -> None:
        self._own.shutdown(socket.SHUT_RDWR)  # also ends it where another process holds the socket
        self._own.close()
        if self._process is not None:
            self._process.wait()


def _of_the_beginning(environment: dict[str, str]) -> dict[str, str]:
    """Return the variables that Python reads when it starts."""
    return {
        name: value
        for name, value in environment.items()
        if name.startswith(("PYTHON", "LC_", "LANG")) and name not in _READ_LATER
    }


def _take_orphans(yes: bool) -> None:
    ctypes.CDLL(None).prctl(_BECOME_PARENT_OF_ORPHANS, int(yes), 0, 0, 0)


def _be_a_copy(requests: socket.socket) -> NoReturn:
    """Be what a panel left of itself: forked for what it starts, until it is gone."""
    ctypes.CDLL(None).prctl(_NAME_OF_A_PROCESS, NAME.encode(), 0, 0, 0)
    os.setsid()  # signals to the panel's terminal are not for it
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1):  # who reads what the panel prints waits for the panel alone
        os.dup2(nothing, descriptor)
    os.close(nothing)
    with suppress(BaseException):
        _serve(requests)
    os._exit(0)


def _serve(requests: socket.socket) -> None:
    """Fork a command for each request until the requesting process is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the commands
    while True:
        asked, ends, _, _ = socket.recv_fds(requests, _LONGEST, 8)
        if not asked:
            return
        reading, writing = os.pipe()
        if between := os.fork():
            os.close(writing)
            number = os.read(reading, 64)
            os.waitpid(between, 0)  # from now on its child belongs to the test's process
            requests.send(number)
            for descriptor in (*ends, reading):
                os.close(descriptor)
        elif child := os.fork():
            os.write(writing, str(child).encode())
            os._exit(0)
        else:
            for descriptor in (reading, writing, requests.detach()):
                os.close(descriptor)
            _become(json.loads(asked), ends)


def import_all() -> None:
    """Import what commands and simulators use, and read the grammar of SPEL+."""
    for name in _PACKAGES:
        package = import_module(name)
        for module in pkgutil.walk_packages(package.__path__, f"{name}."):
            if not module.name.endswith("__main__"):
                with suppress(ImportError):  # of another system
                    import_module(module.name)
    for late in _LOADED_LATE:
        with suppress(ImportError):  # without the extra
            import_module(late)
    from robolink_simulators.epson.spel.parser import parse

    parse("Motor On")  # its grammar is read once


def _become(
    asked: tuple[int, list[str], str, dict[str, str], bool, list[int]], ends: list[int]
) -> NoReturn:
    """Behave as a Python that was just started with this command line."""
    import fcntl  # not on each system on which this module is imported

    parent, words, cwd, env, new_session, kept = asked
    while os.getppid() != parent:
        time.sleep(0.0002)
    # First out of the way of the numbers that they are to have, as one may have another's.
    aside = [fcntl.fcntl(descriptor, fcntl.F_DUPFD, _FREE_FROM) for descriptor in ends]
    for descriptor in ends:
        os.close(descriptor)
    for own, descriptor in zip((0, 1, 2, *kept), aside, strict=True):
        os.dup2(descriptor, own)
        os.close(descriptor)
    ctypes.CDLL(None).prctl(_NAME_OF_A_PROCESS, b"python", 0, 0, 0)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if new_session:
        os.setsid()
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(env)
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        opened = _opened(getattr(sys, name), descriptor)
        setattr(sys, name, opened)
        setattr(sys, f"__{name}__", opened)
    program, *sys.argv[1:] = words
    if program == "robolink_cli" and _STARTS_OTHERS in words:
        _started[os.getpid()] = _WarmProcess(copied=True)
        install()
    if "." in program:  # a new Python has not imported what it is to run
        sys.modules.pop(program, None)
    code: Any = 1
    try:
        runpy.run_module(program, run_name="__main__", alter_sys=True)
        code = 0
    except SystemExit as end:
        code = end.code
    except BaseException:
        traceback.print_exc()
    finally:
        threading._shutdown()  # type: ignore[attr-defined]
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(code if isinstance(code, int) else int(code is not None))


def _opened(before: Any, descriptor: int) -> io.TextIOWrapper:
    """Open a stream as Python does at its start."""
    binary: Any = open(  # noqa: SIM115 - as long as the process runs
        descriptor,
        "wb" if descriptor else "rb",
        buffering=0 if descriptor and os.environ.get("PYTHONUNBUFFERED") else -1,
        closefd=False,
    )
    encoding, _, errors = os.environ.get("PYTHONIOENCODING", "").partition(":")
    if encoding and descriptor != 2:
        errors = errors or "strict"
    return io.TextIOWrapper(
        binary,
        encoding=encoding or before.encoding,
        errors=errors or before.errors,
        newline="\n" if descriptor else None,
        line_buffering=descriptor == 2 or os.isatty(descriptor),
        write_through=bool(os.environ.get("PYTHONUNBUFFERED")),
    )


def _main(descriptor: int) -> None:
    from robolink_cli.panel.stop import load_opcua

    gc.disable()  # imported objects are not garbage
    import_all()
    load_opcua()  # which each panel's process of stops does too
    gc.freeze()
    gc.enable()
    gc.set_threshold(10_000, 10, 10)  # as in the tests; with it no simulator counts what is frozen
    _serve(socket.socket(fileno=descriptor))


if __name__ == "__main__":
    _main(int(sys.argv[1]))
