"""The tests of each row, read from the sources so that no test needs to be collected first."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[3]


@dataclass(frozen=True, slots=True)
class Showing:
    """One test, and the rows in its marks."""

    file: str
    """The path from the root of the repository."""
    test: str
    """The function or class, for all of its parameters."""
    faults: tuple[str, ...]
    soak: bool
    """Whether all of it runs only in ``make soak``."""

    @property
    def node(self) -> str:
        """Its name in pytest."""
        return f"{self.file}::{self.test}"


@cache
def showings() -> tuple[Showing, ...]:
    """Return every marked test. Raises ``ValueError`` for a mark on something else."""
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    return tuple(found for file in files for found in marked(file))


def marked(file: Path) -> Iterator[Showing]:
    """Yield the tests of a file that are marked with a row."""
    source = file.read_text(encoding="utf-8")
    # Parsing all tests takes seconds; nine in ten files have no mark.
    if "mark.fault" not in source:
        return
    name = str(file.relative_to(ROOT))
    borne = 0
    tree = ast.parse(source)
    module = tree.body
    all_soak = any(isinstance(node, ast.Assign) and _soaks(node) for node in module)
    for node in module:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            marks = [m for decorator in node.decorator_list for m in _marks(decorator, "fault")]
            borne += len(marks)
            if marks:
                soak = all_soak or any(_is_mark(d, "soak") for d in node.decorator_list)
                yield Showing(name, node.name, tuple(_numbers(marks, name)), soak)
    if borne != sum(1 for _ in _marks(tree, "fault")):
        raise ValueError(f"{name}: a mark `fault` belongs above a test, or to its parameters")


def _soaks(node: ast.Assign) -> bool:
    return ast.unparse(node.targets[0]) == "pytestmark" and any(
        _is_mark(part, "soak") for part in ast.walk(node.value)
    )


def _marks(tree: ast.AST, name: str) -> Iterator[ast.Call]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and _is_mark(node.func, name):
            yield node


def _is_mark(node: ast.AST, name: str) -> bool:
    # Asked for every node of every test, so the most expensive check comes last.
    return (
        isinstance(node, ast.Attribute)
        and node.attr == name
        and ast.unparse(node) == f"pytest.mark.{name}"
    )


def _numbers(marks: list[ast.Call], file: str) -> Iterator[str]:
    for argument in (a for mark in marks for a in mark.args):
        if not isinstance(argument, ast.Constant) or not isinstance(argument.value, str):
            raise ValueError(f"{file}:{argument.lineno}: name the fault itself, as in 'F01'")
        yield argument.value
