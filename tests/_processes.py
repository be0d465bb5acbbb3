"""Shares the tests of a run among processes: ``pytest --processes 2``.

The process that prints collects the tests once and then forks. Importing and collecting all tests
takes 20 s, which each process would otherwise repeat, and two would compile the same modules side
by side. A process takes one test module at a time, so that all tests of a module share its
fixtures, and sends its reports through a pipe.
"""

import os
import pickle
import struct
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from itertools import chain, compress, groupby
from multiprocessing.connection import Connection, Pipe, wait
from typing import Any

import pytest

from tests._room import with_room
from tests._warm_process import import_all

_NUMBER = struct.Struct("H")
"""The format of a module's number in the pipe from which the processes take their work."""
_LONGEST_KEPT_S = 0.1
"""Reports of passed tests are collected for this long, then sent together."""
_LATE = ("asyncua", "cv2")
"""Packages of which tests of many modules need one; each takes a quarter of a second."""
_OF_THE_PRINTER = ("LFPlugin", "NFPlugin", "StepwisePlugin", "LogXML")
"""Plug-ins that record the whole run; the test processes do without them."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option ``--processes``."""
    parser.addoption(
        "--processes",
        type=int,
        default=1,
        metavar="N",
        help="share the tests among N forked processes (POSIX)",
    )


def pytest_runtestloop(session: pytest.Session) -> bool | None:
    """Run the tests in as many processes as requested; ``None`` leaves the run to pytest."""
    count = session.config.getoption("processes")
    if count < 2 or session.config.option.collectonly or session.testsfailed:
        return None
    if not hasattr(os, "fork"):
        raise pytest.UsageError("--processes needs a system that can fork; leave it out")
    modules = _units(session.items)
    # Tests of faults fork, which costs less while little was run: it copies tables of all memory.
    modules.sort(key=lambda tests: "faults" not in tests[0].path.parts)
    queue = _numbers(len(modules))
    # Once, and not in each of them.
    import_all()
    for package in _LATE:
        with suppress(ImportError):
            import_module(package)
    session.config.get_terminal_writer().flush()
    session.config._tmp_path_factory.getbasetemp()  # type: ignore[attr-defined]
    runs = dict(_start(session, modules, queue, number) for number in range(count))
    os.close(queue)
    try:
        _hear(session, runs)
    finally:
        for end, pid in runs.items():
            end.close()  # a process that still runs ends at its next report
            os.waitpid(pid, 0)
    if session.shouldfail:
        raise session.Failed(session.shouldfail)
    if session.shouldstop:
        raise session.Interrupted(session.shouldstop)
    return True


def _units(items: list[pytest.Item]) -> list[list[pytest.Item]]:
    """Return the tests of each module; those of all that use the database server are together."""
    modules = [list(tests) for _, tests in groupby(items, lambda test: test.path)]
    served = [any(map(_uses_server, tests)) for tests in modules]
    together = list(chain.from_iterable(compress(modules, served)))
    others = [tests for tests, uses in zip(modules, served, strict=True) if not uses]
    return [together, *others] if together else others


def _uses_server(test: pytest.Item) -> bool:
    """Whether a test has the run's ``server``, or a parameter for which its fixtures ask for it."""
    drawn = getattr(getattr(test, "callspec", None), "params", {}).values()
    if any(isinstance(one, str) and one == "postgresql" for one in drawn):
        return True
    known = getattr(test, "_fixtureinfo", None)
    found = known.name2fixturedefs.get("server") if known is not None else None
    return found is not None and found[-1].scope == "session"


def _numbers(count: int) -> int:
    """Return the reading end of a pipe that holds 0 to ``count`` - 1; each number is read once."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    for number in range(count):
        os.write(writing, _NUMBER.pack(number))
    os.close(writing)
    return reading


def _start(
    session: pytest.Session, modules: list[list[pytest.Item]], queue: int, number: int
) -> tuple[Connection, int]:
    """Fork a process that takes modules from ``queue``."""
    reading, writing = Pipe(duplex=False)
    if pid := os.fork():
        writing.close()
        return reading, pid
    try:
        reading.close()
        sender = _prepare(session.config, writing, number)
        with_room(lambda: _run(session, modules, queue))
        sender.send()
        writing.send_bytes(b"")
    except (BrokenPipeError, KeyboardInterrupt):
        pass  # the printing process has stopped reading
    except BaseException:
        traceback.print_exc(file=sys.__stderr__)
    finally:
        os._exit(0)


def _prepare(config: pytest.Config, writing: Connection, number: int) -> "_Sender":
    """Give this process its own captures and folder; send its reports to the printing one."""
    capture = config.pluginmanager.getplugin("capturemanager")
    if capture is not None and capture.is_globally_capturing():
        capture.stop_global_capturing()
        capture.start_global_capturing()
    plugins, writer = config.pluginmanager, config.get_terminal_writer()
    writer._file = open(os.devnull, "w")  # noqa: SIM115 - as long as it runs
    plugins.unregister(name="terminalreporter")
    plugins.register(_Silent(writer), "terminalreporter")
    for plugin in plugins.get_plugins():
        if type(plugin).__name__ in _OF_THE_PRINTER:
            plugins.unregister(plugin)
    folders = config._tmp_path_factory  # type: ignore[attr-defined]
    folders._given_basetemp = folders.getbasetemp() / f"process-{number}"
    folders._basetemp = None
    sender = _Sender(config, writing)
    plugins.register(sender)
    return sender


class _Silent:
    """Replaces the terminal reporter that pytest and plug-ins look for."""

    def __init__(self, writer: Any) -> None:
        self._tw = writer


class _Sender:
    """A plug-in that sends reports in batches, because waking the printer takes as long as a test.

    A test that did not pass is reported at once.
    """

    def __init__(self, config: pytest.Config, writing: Connection) -> None:
        self._config = config
        self._writing = writing
        self._reports: list[Any] = []
        self._sent_s = 0.0

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Send a report, or keep it for the next batch."""
        hook = self._config.hook
        self._reports.append(hook.pytest_report_to_serializable(config=self._config, report=report))
        now_s = time.monotonic()
        if not report.passed or now_s - self._sent_s > _LONGEST_KEPT_S:
            self._sent_s = now_s
            self.send()

    def send(self) -> None:
        """Send the reports that were kept."""
        reports, self._reports = self._reports, []
        if reports:
            self._writing.send_bytes(pickle.dumps(reports))


def _run(session: pytest.Session, modules: list[list[pytest.Item]], queue: int) -> None:
    """Run the tests, module by module."""
    tests = (test for number in _taken(queue) for test in modules[number])
    test = next(tests, None)
    while test is not None and not (session.shouldstop or session.shouldfail):
        following = next(tests, None)
        test.config.hook.pytest_runtest_protocol(item=test, nextitem=following)
        test = following
    session.config.hook.pytest_sessionfinish(session=session, exitstatus=0)


def _taken(queue: int) -> Iterator[int]:
    while number := os.read(queue, _NUMBER.size):
        yield _NUMBER.unpack(number)[0]


def _hear(session: pytest.Session, runs: dict[Connection, int]) -> None:
    """Pass the processes' reports to the plug-ins here until all have ended."""
    hook = session.config.hook
    open_ends = set(runs)
    while open_ends and not (session.shouldstop or session.shouldfail):
        for end in wait(open_ends):
            assert isinstance(end, Connection)
            try:
                data = end.recv_bytes()
            except EOFError:
                raise session.Interrupted(f"test process {runs[end]} ended in the middle") from None
            if not data:
                open_ends.discard(end)
                continue
            for told in pickle.loads(data):
                report = hook.pytest_report_from_serializable(config=session.config, data=told)
                if report.when == "setup":
                    hook.pytest_runtest_logstart(nodeid=report.nodeid, location=report.location)
                hook.pytest_runtest_logreport(report=report)
                if report.when == "teardown":
                    hook.pytest_runtest_logfinish(nodeid=report.nodeid, location=report.location)
