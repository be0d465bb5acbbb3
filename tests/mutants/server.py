"""``python -m tests.mutants.server``, started in a copy of the tree: judges that copy.

It imports everything but the product once, and forks for each judgement, so that a judgement begins
in milliseconds and leaves nothing behind. A line of JSON on its input is a request, one on its
output the answer.
"""

import contextlib
import importlib
import json
import os
import re
import resource
import select
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

_HEAVY: Final = (
    "pytest",
    "numpy",
    "pydantic",
    "sqlite3",
    "click",
    "rich.console",
    "rich.table",
    "lark",
    "jinja2",
    "pymodbus.client",
    "canopen",
    "can",
    "serial",
    "platformdirs",
)
_MEMORY: Final = 8 << 30
"""Address space of a judgement in bytes; a mutant that appends endlessly ends there."""

WAITING_S: Final = 60
"""Wall time after which a single test counts as hanging."""

_MISSING: Final = re.compile(r"^ERROR: not found: .*?/(tests/\S+)$", re.MULTILINE)
"""pytest's message for a missing test, such as one made from missing data."""

Asked = dict[str, Any]


class _Verdict:
    """A plug-in of pytest that keeps the first failure."""

    def __init__(self) -> None:
        self.first: dict[str, str] = {}
        self.passed = 0

    def pytest_runtest_logreport(self, report: Any) -> None:
        self.passed += report.when == "call" and report.passed
        self._keep(report)

    def pytest_collectreport(self, report: Any) -> None:
        self._keep(report)

    def _keep(self, report: Any) -> None:
        if report.failed and not self.first:
            text = str(report.longrepr)
            last = [line for line in text.splitlines() if line.startswith("E ")] or [text[-200:]]
            how = "hang" if "Timeout (>" in text else "failed"
            self.first = {"how": how, "test": report.nodeid, "why": last[0][:200]}


def _by_tests(asked: Asked) -> Asked:
    import pytest

    verdict = _Verdict()
    options = ["-x", "-q", "-p", "no:cacheprovider", "-o", "addopts="]
    options += ["--import-mode=importlib", f"--timeout={WAITING_S}"]
    options += [f"--basetemp={asked['folder']}/tests"]
    code = pytest.main([*options, *asked["tests"]], plugins=[verdict])
    if code == pytest.ExitCode.USAGE_ERROR and not verdict.first:
        output = (Path(asked["folder"]) / "output").read_text(errors="replace")
        return {"how": "unknown", "missing": _MISSING.findall(output)}
    if code and not verdict.first:
        verdict.first = {"how": "failed", "test": "", "why": f"pytest ended with {code!s}"}
    return {**(verdict.first or {"how": "passed"}), "passed": verdict.passed}


def _by_soak(asked: Asked) -> Asked:
    from tests.soak.known_defects import KnownDefect
    from tests.soak.mutant_table import search_for

    search = search_for(KnownDefect("a mutant", {}))
    if not search.rule:
        return {"how": "passed", "hours": search.hours}
    return {"how": "failed", "rule": search.rule, "seed": search.seed, "hours": search.hours}


_WAYS: Final[dict[str, Callable[[Asked], Asked]]] = {"tests": _by_tests, "soak": _by_soak}


def _in_a_child(asked: Asked, answer: int) -> None:
    os.setsid()
    limit = int(asked["cpu_s"]) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    folder = Path(asked["folder"])
    folder.mkdir(parents=True, exist_ok=True)
    os.environ["ROBOLINK_STATE_DIR"] = str(folder / "state")
    output = os.open(folder / "output", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    nothing = os.open(os.devnull, os.O_RDONLY)
    for source, target in ((nothing, 0), (output, 1), (output, 2)):
        os.dup2(source, target)
    try:
        told = _WAYS[asked["way"]](asked)
    except BaseException as error:
        told = {"how": "failed", "rule": f"raised {type(error).__name__}: {error}"[:200]}
        told |= {"test": "", "why": told["rule"]}
    os.write(answer, json.dumps(told).encode())


def _judged(asked: Asked) -> Asked:
    """Fork, wait for the judgement, and end any remaining processes."""
    reading, writing = os.pipe()
    begun_s = time.monotonic()
    child = os.fork()
    if not child:
        with contextlib.suppress(BaseException):
            os.close(reading)
            _in_a_child(asked, writing)
        os._exit(0)
    os.close(writing)
    told = b""
    while (left_s := begun_s + asked["wall_s"] - time.monotonic()) > 0:
        if not select.select([reading], [], [], left_s)[0]:
            told = b'{"how": "given up", "why": "by the clock"}'
            break
        if not (part := os.read(reading, 1 << 16)):
            break
        told += part
        with contextlib.suppress(ValueError):
            json.loads(told)
            break
    os.close(reading)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    _, status, usage = os.wait4(child, 0)
    cpu_s = round(usage.ru_utime + usage.ru_stime, 2)
    answer = json.loads(told) if told else {"how": "hang", "test": "", "why": _end(status)}
    return {**answer, "cpu_s": cpu_s, "wall_s": round(time.monotonic() - begun_s, 2)}


def _end(status: int) -> str:
    if os.WIFSIGNALED(status):
        return f"ended by {signal.Signals(os.WTERMSIG(status)).name}"
    return f"ended with {os.waitstatus_to_exitcode(status)}"


def main() -> None:
    """Answer until the input ends."""
    for name in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    for name in _HEAVY:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    for line in sys.stdin:
        asked = json.loads(line)
        print(json.dumps(_judged(asked)), flush=True)


if __name__ == "__main__":
    main()
