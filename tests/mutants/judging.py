"""One mutant after another in a copy of the tree: its tests first, then the adversary."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

from tests.mutants.changes import Mutant
from tests.mutants.lines import Lines
from tests.mutants.places import ROOT

MOST_CPU_S: Final = 120.0
"""The CPU time of a mutant's tests together; the adversary gets as much again."""

MOST_WALL_S: Final = 1800.0
"""Wall time after which a judgement is given up on a busy computer."""

_FIRST: Final = 12
_NEXT: Final = 150
"""Tests collected at first, and each time after: most mutants die in the first batch."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """The judgement of a mutant.

    Attributes:
        by: ``tests``, ``soak``, or ``neither``.
        how: ``failed``, ``hang`` if it ran out of time, else empty.
        what: The test that failed, or the rule that was broken.
        why: Its message.
        executed: Whether a test executes the line.
        asked: The number of tests run.
        passed: The number that passed.
        cpu_s: The CPU time.
    """

    by: str
    how: str = ""
    what: str = ""
    why: str = ""
    executed: bool = True
    asked: int = 0
    passed: int = 0
    cpu_s: float = 0.0

    def plain(self) -> dict[str, Any]:
        """Return it as plain values."""
        return asdict(self)


class Copy:
    """A copy of the tree, and a process in it that judges.

    Args:
        folder: Its folder; existing files are replaced.
    """

    def __init__(self, folder: Path) -> None:
        self._tree = folder
        self._work = Path(tempfile.mkdtemp(prefix="rm-"))
        self._sound: dict[tuple[str, ...], bool] = {}
        self._unsound: set[str] = set()
        self._made = 0
        shutil.rmtree(folder, ignore_errors=True)
        for name in _files():
            if (ROOT / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, folder / name)
        beside = folder.with_name("shared")
        if not beside.exists() and (ROOT.parent / "shared").exists():
            beside.symlink_to(ROOT.parent / "shared")  # some tests read files beside the tree
        paths = [str(folder), str(folder / "cli"), str(folder / "simulators")]
        home = self._work / "home"
        home.mkdir()
        self._server = subprocess.Popen(
            [sys.executable, "-m", "tests.mutants.server"],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths), "HOME": str(home)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def close(self) -> None:
        """End the process; the copy stays for inspection."""
        if self._server.stdin:
            self._server.stdin.close()
        self._server.wait(MOST_WALL_S)
        shutil.rmtree(self._work, ignore_errors=True)

    def judge(self, mutant: Mutant, lines: Lines) -> Judgement:
        """Return the finder of a mutant: a test, else the adversary, else nothing."""
        tests = lines.tests_of(mutant)
        asked = lines.affordable(tests)
        by_tests = self._by_tests(mutant, asked)
        if by_tests.by == "tests":
            return by_tests
        if not lines.adversary_executes(mutant):
            return replace(by_tests, executed=bool(tests))
        with self._in_place(mutant):
            told = self._ask("soak", cpu_s=MOST_CPU_S)
        found = told["how"] in {"failed", "hang"}
        return Judgement(
            by="soak" if found else "neither",
            how=told["how"] if found else "",
            what=told.get("rule") or told.get("why", ""),
            why=f"seed {told['seed']}, hour {told['hours']}" if "seed" in told else "",
            executed=bool(tests),
            asked=by_tests.asked,
            passed=by_tests.passed,
            cpu_s=round(by_tests.cpu_s + told["cpu_s"], 2),
        )

    def _by_tests(self, mutant: Mutant, asked: list[str]) -> Judgement:
        asked = [one for one in asked if _function(one) not in self._unsound]
        left, passed, spent_s = list(asked), 0, 0.0
        sizes = iter((_FIRST, _NEXT))
        while left and spent_s < MOST_CPU_S:
            size = next(sizes, len(left))
            part, left = left[:size], left[size:]
            with self._in_place(mutant):
                told = self._ask("tests", cpu_s=MOST_CPU_S - spent_s, tests=part)
            spent_s, passed = spent_s + told["cpu_s"], passed + told.get("passed", 0)
            if told["how"] == "passed":
                continue
            test = told.get("test", "")
            if told["how"] == "unknown" or (test and not self._is_sound(test, part)):
                self._unsound |= {_function(one) for one in told.get("missing") or [test]}
                rest = part[part.index(test) + 1 :] if test in part else part
                left = [one for one in (*rest, *left) if _function(one) not in self._unsound]
                asked = [one for one in asked if _function(one) not in self._unsound]
                continue
            if told["how"] == "given up":
                break
            return Judgement(
                by="tests",
                how=told["how"],
                what=test,
                why=told.get("why", ""),
                asked=len(asked),
                passed=passed,
                cpu_s=round(spent_s, 2),
            )
        return Judgement(by="neither", asked=len(asked), passed=passed, cpu_s=round(spent_s, 2))

    def _is_sound(self, test: str, part: list[str]) -> bool:
        """Return whether the failed test passes without the mutant, after the same tests.

        What cannot even be imported is a module: then it is whether those of its tests pass.
        """
        of_module = [one for one in part if one.partition("::")[0] == test]
        before = tuple(part[: part.index(test) + 1] if test in part else of_module or [test])
        if before not in self._sound:
            told = self._ask("tests", cpu_s=MOST_CPU_S, tests=list(before))
            self._sound[before] = told["how"] == "passed"
        return self._sound[before]

    @contextmanager
    def _in_place(self, mutant: Mutant) -> Iterator[None]:
        path = self._tree / mutant.file
        sound, times = path.read_bytes(), path.stat()
        self._made += 1
        try:
            path.write_bytes(mutant.applied(sound))
            # Python compares compiled files by size and time in seconds, and both may be unchanged.
            os.utime(path, (times.st_atime, times.st_mtime + self._made))
            yield
        finally:
            path.write_bytes(sound)
            os.utime(path, (times.st_atime, times.st_mtime))
            for compiled in path.parent.glob(f"__pycache__/{path.stem}.*.pyc"):
                compiled.unlink()

    def _ask(self, way: str, *, cpu_s: float, tests: list[str] | None = None) -> dict[str, Any]:
        asked = {"way": way, "cpu_s": cpu_s, "wall_s": MOST_WALL_S, "tests": tests or []}
        if not (self._server.stdin and self._server.stdout):
            raise RuntimeError("the judge has no pipes")
        self._server.stdin.write(json.dumps({**asked, "folder": str(self._work)}) + "\n")
        self._server.stdin.flush()
        answer = self._server.stdout.readline()
        if not answer:
            raise RuntimeError("the judge has ended; its output is above")
        told: dict[str, Any] = json.loads(answer)
        return told


def _function(test: str) -> str:
    """Return a test's name without its parameters."""
    return test.partition("[")[0]


def _files() -> list[str]:
    """Return the files of the tree, and the compiled catalogues, by path from its root."""
    command = ["git", "ls-files", "-co", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    made = [path.relative_to(ROOT).as_posix() for path in (ROOT / "robolink").rglob("*.mo")]
    return listed.stdout.splitlines() + made
