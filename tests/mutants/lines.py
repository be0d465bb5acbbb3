"""The tests that execute a line, and their order.

The default suite is run once with coverage, each test a context (:mod:`tests.mutants.contexts`). If
only tests have changed since, only their files are run again; if the product has, all are. Changes
in shared test helpers are not noticed: tests run as they are today in any case, only the record of
their lines is older.
"""

import ast
import hashlib
import json
import os
import shutil
import sqlite3
import subprocess
import sys
from collections import defaultdict
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Final

from tests.mutants.changes import Mutant
from tests.mutants.places import ROOT, modules, sources

COVERAGE: Final = "coverage==7.17.5"
"""No other command needs it, so it is no development dependency."""

FOLDER: Final = "ROBOLINK_MUTANTS_LINES"
"""The environment variable with the folder for :mod:`tests.mutants.contexts`."""

FEW: Final = 10
"""If fewer tests than these execute a line, those that execute its module are run as well: an
object made once per process is recorded for the first test alone. The same applies where a function
remembers its results.
"""

MOST_RECORDED_S: Final = 40.0
"""Tests are taken up to this CPU time, coverage included. A mutant gets three times as much, so
that one that takes longer has made them slower.
"""

LONGEST_S: Final = 10.0
"""A more expensive test is not run."""


def record(folder: Path) -> None:
    """Run the tests without a record; the first time these are all.

    Args:
        folder: The folder of the record. Each run adds a folder to it.
    """
    product = sources(ROOT)
    files = [path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").rglob("test_*.py")]
    now = {file: _hash(ROOT / file) for file in files if not file.startswith("tests/integrator/")}
    known: dict[str, str] = {}
    for batch in _batches(folder):
        told = json.loads((batch / "tests.json").read_text())
        if told["product"] != product:
            shutil.rmtree(batch)
        else:
            known |= told["tests"]
    if not (folder / "adversary" / product).exists():
        shutil.rmtree(folder / "adversary", ignore_errors=True)
        command = [sys.executable, "-m", "tests.mutants.adversary", str(folder / "adversary")]
        subprocess.run(command, cwd=ROOT, env=_environment(folder), check=True)
        (folder / "adversary" / product).touch()
    changed = sorted(file for file in now if known.get(file) != now[file])
    if not changed:
        return
    batch = folder / f"{1 + max((int(one.name) for one in _batches(folder)), default=0):04d}"
    shutil.rmtree(batch, ignore_errors=True)
    batch.mkdir(parents=True)
    asked = changed if known else ["tests"]
    command = [sys.executable, "-m", "pytest", "-p", "tests.mutants.contexts", "-q"]
    command += ["--processes", "2"]
    with (batch / "output").open("wb") as output:
        subprocess.run(
            [*command, "--timeout=240", *asked],
            cwd=ROOT,
            env={**_environment(folder), FOLDER: str(batch)},
            stdout=output,
            stderr=output,
            check=False,
        )
    told = {"product": product, "tests": {file: now[file] for file in changed}}
    (batch / "tests.json").write_text(json.dumps(told))


def _environment(folder: Path) -> dict[str, str]:
    """Return an environment with coverage, which is installed beside the record."""
    beside = folder / "coverage"
    if not (beside / "coverage").exists():
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target"]
        subprocess.run([*pip, str(beside), COVERAGE], check=True)
    return {**os.environ, "PYTHONPATH": str(beside)}


def _batches(folder: Path) -> list[Path]:
    """Return the complete runs of the record, the oldest first."""
    return sorted(path.parent for path in folder.glob("*/tests.json"))


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:12]


class Lines:
    """The record of lines by test.

    Args:
        folder: The folder of the record's batches, each a folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._costs: dict[str, float] = {}
        self._batch_of: dict[str, str] = {}
        self._bad: set[str] = set()
        self._data: list[tuple[str, Path]] = []
        self._executed: dict[str, dict[str, set[int]]] = {}
        for batch in _batches(folder):
            self._read(batch)

    def _read(self, batch: Path) -> None:
        told = json.loads((batch / "tests.json").read_text())
        self._batch_of |= dict.fromkeys(told["tests"], batch.name)
        for path in sorted(batch.glob("failed.*.jsonl")):
            self._bad |= {json.loads(line)["test"] for line in path.open()}
        for path in sorted(batch.glob("costs.*.jsonl")):
            for line in path.open():
                row = json.loads(line)
                self._costs[row["test"]] = row["cpu_s"]
        self._data += [(batch.name, path) for path in sorted(batch.glob("lines.*"))]

    def executed(self, file: str) -> dict[str, set[int]]:
        """Return the lines of a module that each test executes; the empty name is its import."""
        if file not in self._executed:
            found: dict[str, set[int]] = defaultdict(set)
            for batch, path in self._data:
                for test, numbers in _rows(path, ROOT / file):
                    if not test or self._batch_of.get(test.partition("::")[0]) == batch:
                        found[test] |= _numbers(numbers)
            self._executed[file] = dict(found)
        return self._executed[file]

    def adversary_executes(self, mutant: Mutant) -> bool:
        """Return whether the adversary reaches a mutant's line at all; its histories are fixed."""
        rows = _rows(self._folder / "adversary" / "lines", ROOT / mutant.file)
        seen = {number for _, numbers in rows for number in _numbers(numbers)}
        first = min(mutant.line, mutant.statement[0])
        last = max(mutant.last_line, mutant.statement[1])
        return bool(seen if not mutant.called else seen & set(range(first, last + 1)))

    def tests_of(self, mutant: Mutant) -> list[str]:
        """Return the tests that execute a mutant's line, the quickest of each kind first."""
        executed = self.executed(mutant.file)
        lines = set(range(mutant.line, mutant.last_line + 1))
        around = set(range(mutant.statement[0], mutant.statement[1] + 1))
        bodies = _lines_of_functions(mutant.file)
        whole = {test for test, seen in executed.items() if test and seen & bodies}
        if mutant.called:
            direct = {test for test, seen in executed.items() if test and seen & lines}
            direct = direct or {test for test, seen in executed.items() if test and seen & around}
            if not direct:
                return []
            if mutant.where in _remembering(mutant.file):
                direct |= whole
            more = whole - direct if len(direct) < FEW else set()
        else:
            # The contents of a module show where they are used, also in modules that import it.
            direct = whole | {test for test, seen in executed.items() if test and seen & around}
            direct, more = direct | self._of_importers(mutant.file), set()
        return self._ordered(direct, mutant) + self._ordered(more, mutant)

    def _of_importers(self, file: str) -> set[str]:
        tests: set[str] = set()
        for importer in _importers().get(file, ()):
            bodies = _lines_of_functions(importer)
            tests |= {
                test for test, seen in self.executed(importer).items() if test and seen & bodies
            }
        return tests

    def _ordered(self, tests: set[str], mutant: Mutant) -> list[str]:
        """Put the quickest of each function first, then its next; those near count as quicker."""
        kinds: dict[str, list[str]] = defaultdict(list)
        for test in tests - self._bad:
            if self._costs.get(test, 1.0) <= LONGEST_S:
                kinds[test.partition("[")[0]].append(test)
        words = set(mutant.file.removesuffix(".py").replace("/", "_").split("_")) - {"", "robolink"}

        def cost(test: str) -> float:
            near = words & set(
                test.partition("::")[0].replace("/", "_").replace(".", "_").split("_")
            )
            return self._costs.get(test, 1.0) / (1 + len(near)) ** 2

        ranked = []
        for alike in kinds.values():
            for rank, test in enumerate(sorted(alike, key=lambda test: (cost(test), test))):
                ranked.append((rank, cost(test), test))
        return [test for _, _, test in sorted(ranked)]

    def affordable(self, tests: list[str]) -> list[str]:
        """Return the first tests, up to the limit for a mutant."""
        taken, spent_s = [], 0.0
        for test in tests:
            spent_s += self._costs.get(test, 1.0)
            if spent_s > MOST_RECORDED_S:
                break
            taken.append(test)
        return taken


def _rows(data: Path, module: Path) -> list[tuple[str, bytes]]:
    """Return context and lines of one module, in one query for all tests (coverage.dbschema)."""
    query = (
        "SELECT context.context, numbits FROM line_bits JOIN file ON file.id = file_id "
        "JOIN context ON context.id = context_id WHERE path = ?"
    )
    with closing(sqlite3.connect(f"file:{data}?mode=ro", uri=True)) as connection:
        return list(connection.execute(query, (str(module),)))


def _numbers(numbits: bytes) -> set[int]:
    """Return the lines in a set of bits (coverage.numbits)."""
    return {
        8 * place + bit for place, byte in enumerate(numbits) for bit in range(8) if byte >> bit & 1
    }


@cache
def _lines_of_functions(file: str) -> frozenset[int]:
    """Return the lines that run when a function is called."""
    found: set[int] = set()
    for node in ast.walk(ast.parse((ROOT / file).read_bytes())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            found |= set(range(node.body[0].lineno, (node.end_lineno or node.lineno) + 1))
    return frozenset(found)


@cache
def _remembering(file: str) -> frozenset[str]:
    """Return the qualified names of functions that run once per argument."""
    found: set[str] = set()

    def look(node: ast.AST, scope: str) -> None:
        for one in ast.iter_child_nodes(node):
            inner = scope
            if isinstance(one, ast.FunctionDef | ast.ClassDef):
                inner = f"{scope}.{one.name}".lstrip(".")
                if any("cache" in ast.unparse(decorator) for decorator in one.decorator_list):
                    found.add(inner)
            look(one, inner)

    look(ast.parse((ROOT / file).read_bytes()), "")
    return frozenset(found)


@cache
def _importers() -> dict[str, set[str]]:
    """Return, for each module, those that import from it, also by way of its package."""
    files, trees = {}, {}
    for path in modules(ROOT):
        file = path.relative_to(ROOT).as_posix()
        parts = file.removesuffix(".py").removeprefix("cli/").split("/")
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
        trees[file] = [
            node
            for node in ast.walk(ast.parse(path.read_bytes()))
            if isinstance(node, ast.ImportFrom)
        ]

    def origin(module: str, name: str) -> str:
        """Return the module that a name comes from."""
        for node in trees[files[module]] if files[module].endswith("__init__.py") else ():
            if node.module in files and name in {one.asname or one.name for one in node.names}:
                return origin(node.module, name)
        return module

    found: dict[str, set[str]] = defaultdict(set)
    for file, nodes in trees.items():
        for node in nodes:
            for one in node.names if node.module in files else ():
                found[files[origin(str(node.module), one.name)]].add(file)
    return found
