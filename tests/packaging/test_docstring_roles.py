"""A role of a docstring, such as a function's name to click on, leads to something that is there.

A short name is looked for where a reader would: in the class and module of the docstring, with
what these import, and among what the packages around the module hand out.
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from tools.api import public

ROOT = Path(__file__).parents[2]
PACKAGES = ("robolink", "cli/robolink_cli", "simulators/robolink_simulators")
ROLE = re.compile(r":(?:py:)?(mod|class|func|meth|attr|data|exc|const|obj):`([^`]*)`")
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


class Role(NamedTuple):
    """A role in a docstring: where it stands, and what it names."""

    module: str
    owners: tuple[str, ...]
    target: str


def modules() -> Iterator[tuple[str, ast.Module]]:
    """Yield every module that has a role, by its dotted name; others would show nothing."""
    for package in PACKAGES:
        top = (ROOT / package).parent
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(top).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            text = path.read_text(encoding="utf-8")
            if ROLE.search(text):
                yield name, ast.parse(text)


def texts(node: ast.AST, owners: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the docstrings inside a node, those of attributes too, with the classes around them."""
    for child in getattr(node, "body", ()):
        inside = (*owners, child.name) if isinstance(child, ast.ClassDef) else owners
        if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant):
            if isinstance(child.value.value, str):
                yield owners, child.value.value
        elif isinstance(child, DOCUMENTED):
            yield from texts(child, inside)


def targets(text: str) -> Iterator[str]:
    """Yield what the roles of a docstring name."""
    for _, written in ROLE.findall(text):
        named = re.fullmatch(r"[^<]*<([^>]*)>", written)
        target = (named[1] if named else written).strip().lstrip("~!.")
        yield " ".join(target.split()).removesuffix("()")


def roles(module: str, tree: ast.Module) -> Iterator[Role]:
    """Yield the roles in the docstrings of a module."""
    for owners, text in texts(tree):
        for target in targets(text):
            yield Role(module, owners, target)


def imported(tree: ast.Module) -> dict[str, tuple[str, str]]:
    """Return what a module imports, for the type checker and inside functions too."""
    return {
        alias.asname or alias.name: (node.module, alias.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }


def followed(thing: Any, names: list[str]) -> bool:
    """Tell whether an attribute's attribute and so on is there, annotated ones included."""
    for number, name in enumerate(names):
        if not hasattr(thing, name):
            said = {key for one in getattr(thing, "__mro__", ()) for key in _said(one)}
            return number == len(names) - 1 and name in said
        thing = getattr(thing, name)
    return True


def _said(one: type) -> set[str]:
    # What __init__ alone gives to an object is an attribute as well where the docstring names it.
    text = one.__doc__ or ""
    return {*vars(one).get("__annotations__", {}), *re.findall(r"^ {4,8}([\w, ]+):", text, re.M)}


def absolute(names: list[str]) -> bool:
    """Tell whether a whole dotted name leads somewhere."""
    for count in range(len(names), 0, -1):
        try:
            module = import_module(".".join(names[:count]))
        except ImportError:
            continue
        return followed(module, names[count:])
    return False


def leads_somewhere(role: Role, trees: dict[str, ast.Module]) -> bool:
    """Tell whether what a role names is there."""
    names = role.target.split(".")
    if names[0] in {package.rpartition("/")[2] for package in PACKAGES} or len(names) > 2:
        return absolute(names)
    home: Any = import_module(role.module)
    for count in range(len(role.owners), -1, -1):
        owner = home
        for one in role.owners[:count]:
            owner = getattr(owner, one)
        if followed(owner, names):
            return True
    if names[0] in (known := imported(trees[role.module])):
        module, name = known[names[0]]
        return absolute([*module.split("."), name, *names[1:]])
    packages = role.module.split(".")
    around = (".".join(packages[:count]) for count in range(len(packages), 0, -1))
    return any(followed(import_module(package), names) for package in around) or absolute(names)


@cache
def trees() -> dict[str, ast.Module]:
    """Return these modules; not at import, where each process of the suite would read them all."""
    return dict(modules())


@pytest.mark.parametrize("package", [package.rpartition("/")[2] for package in PACKAGES])
def test_what_a_docstring_names_is_there(package):
    found = [
        role
        for name, tree in trees().items()
        if name.split(".")[0] == package
        for role in roles(name, tree)
    ]
    assert len(found) > 20
    assert [role for role in found if not leads_somewhere(role, trees())] == []


def without_a_page(text: str, pages: dict[str, dict[str, object]]) -> list[str]:
    """Return what the roles of a text name by its whole path and no page of the API describes."""
    described = {*pages, *(f"{package}.{name}" for package in pages for name in pages[package])}
    whole = [target for target in targets(text) if target.startswith("robolink")]
    return [one for one in whole if not {one, one.rpartition(".")[0]} & described]


def test_what_a_page_of_the_api_names_has_a_page():
    pages = public()
    texts = [import_module(package).__doc__ or "" for package in pages]
    texts += [
        getattr(thing, "__doc__", "") or "" for named in pages.values() for thing in named.values()
    ]
    assert [one for text in texts for one in without_a_page(text, pages)] == []
    assert without_a_page("Says :mod:`robolink.locale.languages`.", pages)


@pytest.mark.parametrize(
    ("module", "owners", "target", "there"),
    [
        ("robolink.model._movement", ("WorkBox",), "about", True),
        ("robolink.model._movement", ("WorkBox",), "above", False),
        ("robolink.methods.given_poses", (), "TwoTouches", True),
        ("robolink.methods.given_poses", (), "robolink.procedures.TipSource", True),
        ("robolink.methods.given_poses", (), "robolink.procedures.TipSink", False),
        ("robolink.methods.given_poses", (), "solve_two_poses", False),
    ],
)
def test_a_wrong_name_is_found(module, owners, target, there):
    assert leads_somewhere(Role(module, owners, target), trees()) is there
