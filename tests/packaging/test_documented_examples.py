"""Examples of docstrings and commands of the pages run and are up to date."""

import doctest
import enum
import importlib
import inspect
import linecache
import re
import shlex
from collections.abc import Iterator
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

import click
import pytest
from babel.messages.pofile import read_po
from robolink_cli import main
from robolink_cli.command_map import RENAMED

# A callable with three or more parameters says what each is, and shows an example that runs.
# Functions, methods and constructors that a package exports are checked. A value (dataclass,
# enumeration, error) describes its attributes instead; a method of an interface or of a class above
# is described there; a class whose docstring says what makes it is not called by users.

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
"""Packages whose callables are checked: all of the library, and all of the simulators."""

MANY = 3


def handed_out(package: str) -> Iterator[tuple[str, Any]]:
    """Yield a package's exported names with their objects."""
    module = importlib.import_module(package)
    for name in getattr(module, "__all__", ()):
        yield name, getattr(module, name)


INTERFACES = [
    value
    for package in ("robolink.model", "robolink.procedures", "robolink.transport")
    for _, value in handed_out(package)
    if inspect.isclass(value) and getattr(value, "_is_protocol", False)
]
"""The interfaces of controllers and their parts, methods and lines, which have the descriptions."""


def parameters(called: Any) -> list[str]:
    """Return the names of a callable's parameters."""
    return [name for name in inspect.signature(called).parameters if name not in ("self", "cls")]


def is_value(kind: type) -> bool:
    """Return whether a class is a value, described by its attributes."""
    plain = (enum.Enum, BaseException, tuple)
    return is_dataclass(kind) or issubclass(kind, plain) or hasattr(kind, "model_fields")


def callables(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the callables of one name: itself, or its constructor and methods."""
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
    """Return whether two methods have the same parameters."""
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
    """Yield the modules with an example."""
    for top, folder in TOPS.items():
        for path in sorted(folder.rglob("*.py")):
            if ">>> " in path.read_text(encoding="utf-8"):
                parts = path.relative_to(folder).with_suffix("").parts
                yield ".".join((top, *(part for part in parts if part != "__init__")))


def test_every_example_of_a_docstring_runs(tmp_path, monkeypatch):
    finder = doctest.DocTestFinder(exclude_empty=True)
    runner = doctest.DocTestRunner(verbose=False)
    shown: list[str] = []
    # Otherwise each docstring makes Python check every file ever read for a traceback.
    monkeypatch.setattr(linecache, "checkcache", lambda *_: None)
    for module in modules():
        found = finder.find(importlib.import_module(module), globs={})
        for number, test in enumerate(one for one in found if one.examples):
            folder = tmp_path / f"{module}-{number}"
            folder.mkdir()
            monkeypatch.chdir(folder)
            monkeypatch.setenv("ROBOLINK_STATE_DIR", str(folder / "state"))
            runner.run(test, out=shown.append)
    assert "".join(shown) == ""
    assert runner.tries > 1_000


# Every command of README and of the pages exists, and accepts its typed arguments.
# Nothing is carried out here: only names, options and numbers of arguments are checked.
# ``tests/contract/test_pages_typed.py`` runs whole parts of pages.

PAGES = [
    *(ROOT / name for name in ("README.md", "README.zh.md", "SECURITY.md")),
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "reference").glob("*.md")),
    ROOT / "simulators" / "README.md",
]
CODE = re.compile(r"`(robolink [^`]+)`")
LINE = re.compile(r"^(?: {4,}|\$ | *)\$? ?(robolink .+)$")
FENCE = re.compile(r"^ *```")
CUT = re.compile(r"\s+(?:[#|>&;]|2>).*$|\s{3,}\S.*$|\s+\.\.\.?$")
LEAST = 300
"""The least number of commands; with fewer, the pages were parsed wrongly."""


def blocks(text: str) -> Iterator[str]:
    """Yield the lines of fenced and indented blocks, with continued lines joined."""
    inside = False
    for line in text.replace("\\\n", " ").splitlines():
        if FENCE.match(line):
            inside = not inside
        elif inside or line.startswith("    "):
            yield line


def commands(page: Path) -> list[str]:
    """Return the commands of a page as typed, without the shell's part."""
    text = page.read_text(encoding="utf-8")
    found = [match[1] for line in blocks(text) if (match := LINE.match(line))]
    fenced = re.sub(r"^ *```.*?^ *```", "", text, flags=re.M | re.S)
    found += [" ".join(code.split()) for code in CODE.findall(fenced)]
    return [CUT.sub("", one) for one in found]


def problem(line: str) -> str | None:
    """Return the fault of a command, ``None`` if the command line accepts it."""
    words = shlex.split(line.replace("[", "").replace("]", ""))[1:]
    command: click.Command = main.cli
    context = click.Context(command, info_name="robolink")
    while True:
        try:
            parser = command.make_parser(context)
            _values, rest, _ = parser.parse_args(list(words))
        except click.UsageError as error:
            return error.format_message()
        if not isinstance(command, click.Group):
            return None
        if not rest:
            return None
        if rest[0].isupper():  # COMMAND, NAME: any of them
            return None
        if command is main.cli and rest[0] in RENAMED:
            return f"{rest[0]} is now called {RENAMED[rest[0]][1]}"
        found = command.get_command(context, rest[0])
        if found is None:
            return f"there is no {rest[0]!r} in {context.command_path}"
        command, words = found, rest[1:]
        context = click.Context(found, parent=context, info_name=rest[0])


@pytest.fixture(scope="module")
def told():
    return {page: commands(page) for page in PAGES}


def test_every_command_of_the_pages_can_be_typed(told):
    wrong = [
        f"{page.relative_to(ROOT)}: {line}: {why}"
        for page, lines in told.items()
        for line in dict.fromkeys(lines)
        if (why := problem(line))
    ]
    assert not wrong, "\n".join(wrong)
    assert sum(map(len, told.values())) > LEAST


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("robolink recalibrate x.toml", "now called change"),
        ("robolink tool lost", "no 'lost'"),
        ("robolink status --slow", "--slow"),
        ("robolink tool get 1 --mode", "requires an argument"),
    ],
)
def test_a_command_that_cannot_be_typed_is_told(line, why):
    assert why in str(problem(line))


def test_the_sentences_of_troubleshooting_are_those_of_the_screen():
    """Each quoted sentence is in the catalogue; ``...`` stands for a filled-in value."""
    page = (ROOT / "docs" / "stopping.md").read_text(encoding="utf-8")
    page = page.partition("\n## Troubleshooting: ")[2]
    quoted = re.findall(r'^\| "(.+?)" \|', page, re.M)
    with (ROOT / "robolink" / "locale" / "robolink.pot").open("rb") as file:
        sentences = [re.sub(r"\s+", " ", str(one.id)) for one in read_po(file) if one.id]
    shown = {re.sub(r"\{[^}]*\}", "...", sentence) for sentence in sentences}
    assert len(quoted) > 20
    assert [one for one in quoted if not any(one in sentence for sentence in shown)] == []


def test_the_index_names_every_page_once():
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    named = re.findall(r"\]\(([\w.-]+\.md)", index)
    pages = {page.name for page in (ROOT / "docs").glob("*.md")} - {"README.md"}
    assert sorted(named) == sorted(pages)


def test_the_chinese_sheet_has_the_keys_commands_figures_and_pictures_of_the_english_one():
    def facts(name: str) -> tuple[list[str], ...]:
        text = (ROOT / "docs" / name).read_text(encoding="utf-8")
        commands = [one.replace("--lang zh ", "") for one in CODE.findall(text)]
        return (
            re.findall(r"`([!-~])`", text),
            commands,
            re.findall(r"\d[\d.]* mm", text),
            re.findall(r"pictures/([\w-]+)(?:\.zh)?\.svg", text),
            re.findall(r"^\|", text, re.M),
        )

    assert facts("technician.zh.md") == facts("technician.md")
