"""What takes three parameters or more says what each is, and shows a use of it that runs.

Looked at are functions, methods and constructors that a package hands out. A value (dataclass,
enumeration, error) describes its attributes instead; a method that carries out one of a class above
it, or of an interface, is described there; a class of which its docstring says by what
it is made is not called by anybody else.
"""

import doctest
import enum
import importlib
import inspect
import re
from collections.abc import Iterator
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
TOPS = {
    "robolink": ROOT / "robolink",
    "robolink_simulators": ROOT / "simulators" / "robolink_simulators",
}

HELD = sorted(
    {
        ".".join((top, *path.parent.relative_to(folder).parts))
        for top, folder in TOPS.items()
        for path in folder.rglob("__init__.py")
    }
)
"""Packages whose callables are held to it: all of the library, and all of the simulators."""

MANY = 3


def handed_out(package: str) -> Iterator[tuple[str, Any]]:
    """Yield the names that a package lists, and what they are."""
    module = importlib.import_module(package)
    for name in getattr(module, "__all__", ()):
        yield name, getattr(module, name)


INTERFACES = [
    value
    for package in ("robolink.model", "robolink.procedures", "robolink.transport")
    for _, value in handed_out(package)
    if inspect.isclass(value) and getattr(value, "_is_protocol", False)
]
"""What controllers and their parts, methods and lines carry out, and where it is described."""


def parameters(called: Any) -> list[str]:
    """Return the names of what is given to a callable."""
    return [name for name in inspect.signature(called).parameters if name not in ("self", "cls")]


def is_value(kind: type) -> bool:
    """Tell whether a class is a value, described by its attributes."""
    plain = (enum.Enum, BaseException, tuple)
    return is_dataclass(kind) or issubclass(kind, plain) or hasattr(kind, "model_fields")


def callables(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield what is called of one name: itself, or its constructor and methods."""
    if inspect.isfunction(value):
        yield name, value
    if not inspect.isclass(value):
        return
    made = "\nMade by " in (inspect.getdoc(value) or "")
    if not is_value(value) and not made and "__init__" in vars(value):
        yield name, value
    for method, found in vars(value).items():
        plain = found.__func__ if isinstance(found, (classmethod, staticmethod)) else found
        if not inspect.isfunction(plain) or method.startswith("_"):
            continue
        above = any(method in vars(base) for base in value.__mro__[1:])
        interfaces = () if value in INTERFACES else INTERFACES
        if not above and not any(same(plain, vars(one).get(method)) for one in interfaces):
            yield f"{name}.{method}", plain


def same(one: Any, other: Any) -> bool:
    """Tell whether two methods take the same."""
    return inspect.isfunction(other) and parameters(one) == parameters(other)


def with_many(package: str) -> Iterator[tuple[str, Any]]:
    """Yield the callables of a package that take many parameters."""
    for name, value in handed_out(package):
        for called, found in callables(name, value):
            if len(parameters(found)) >= MANY:
                yield called, found


@pytest.mark.parametrize("package", HELD)
def test_what_takes_many_parameters_says_what_each_is_and_shows_a_use(package):
    wrong = []
    for name, found in with_many(package):
        text = inspect.getdoc(found) or ""
        section = re.search(r"^Args:\n((?:    .*\n|\n)*)", f"{text}\n", re.M)
        told = re.findall(r"^    (\w+): ", section[1] if section else "", re.M)
        if told != parameters(found):
            wrong.append(f"{name}: Args names {told}, it takes {parameters(found)}")
        if not re.search(r"^Example:\n    >>> ", text, re.M):
            wrong.append(f"{name}: no example")
    assert wrong == []


def modules() -> Iterator[str]:
    """Yield the modules that hold an example."""
    for top, folder in TOPS.items():
        for path in sorted(folder.rglob("*.py")):
            if ">>> " in path.read_text(encoding="utf-8"):
                parts = path.relative_to(folder).with_suffix("").parts
                yield ".".join((top, *(part for part in parts if part != "__init__")))


def test_every_example_of_a_docstring_runs(tmp_path, monkeypatch):
    finder = doctest.DocTestFinder(exclude_empty=True)
    runner = doctest.DocTestRunner(verbose=False)
    shown: list[str] = []
    for module in modules():
        for number, test in enumerate(finder.find(importlib.import_module(module), globs={})):
            folder = tmp_path / f"{module}-{number}"
            folder.mkdir()
            monkeypatch.chdir(folder)
            monkeypatch.setenv("ROBOLINK_STATE_DIR", str(folder / "state"))
            runner.run(test, out=shown.append)
    assert "".join(shown) == ""
    assert runner.tries > 1_000
