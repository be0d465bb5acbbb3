"""Collects the sentences of the sources, for ``make messages``.

``tr("...")`` and ``declared("...")`` are found wherever they stand; Babel's own reader passes by
those inside of f-strings. The help of a command is written as click wants it, as ``help="..."``
and as the command's docstring.
"""

import ast
import inspect
import re
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import IO, Any, Final

_HELP: Final = ("help", "short_help")
_MAKERS: Final = ("command", "group")
HOLDS_ONE: Final = re.compile(rb"\b(tr|declared)\s*\(|\b(short_)?help\s*=|\b(command|group)\s*\(")
"""Every module with a sentence has this; parsing the others would show nothing."""

_Found = tuple[Any, ...]
"""Line, keyword, sentence and comments, in Babel's order."""


def collect(
    file: IO[bytes],
    keywords: Mapping[str, Any],
    comment_tags: Sequence[str],  # noqa: ARG001 - Babel's form
    options: Mapping[str, Any],  # noqa: ARG001
) -> Iterator[_Found]:
    """Yield the sentences of a module; the form is Babel's."""
    source = file.read()
    if HOLDS_ONE.search(source):
        yield from collected(ast.walk(ast.parse(source)), keywords)


def collected(nodes: Iterable[ast.AST], keywords: Container[str]) -> Iterator[_Found]:
    """Yield the sentences among the nodes of a module."""
    for node in nodes:
        if isinstance(node, ast.Call):
            yield from _of_call(node, keywords)
        elif isinstance(node, ast.FunctionDef) and any(map(_makes, node.decorator_list)):
            docstring = ast.get_docstring(node, clean=False)
            if docstring:
                yield node.lineno, None, _as_click_reads(docstring), []


def _of_call(node: ast.Call, keywords: Container[str]) -> Iterator[_Found]:
    for said in node.args[:1] if getattr(node.func, "id", "") in keywords else ():
        if isinstance(said, ast.Constant):
            yield node.lineno, None, str(said.value), []
    for keyword in node.keywords:
        value = keyword.value
        if keyword.arg in _HELP and isinstance(value, ast.Constant) and value.value:
            yield node.lineno, None, str(value.value), []


def _makes(decorator: ast.expr) -> bool:
    """Return whether a decorator makes a command out of a function."""
    if not isinstance(decorator, ast.Call):
        return False
    made_by = decorator.func
    name = made_by.attr if isinstance(made_by, ast.Attribute) else getattr(made_by, "id", "")
    # With ``help=`` the docstring is for programmers.
    return name in _MAKERS and not any(one.arg == "help" for one in decorator.keywords)


def _as_click_reads(docstring: str) -> str:
    return inspect.cleandoc(docstring).partition("\f")[0]
