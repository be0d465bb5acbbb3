"""Packages whose names are loaded when they are first used (PEP 562).

A stop, a status and ``--help`` may not pay for what they do not use. A package that one of them
passes, and whose names need more than they do, imports them under ``TYPE_CHECKING`` only, each as
itself (``from home import name as name``): the list that the type checker and readers see is read
by the running program, too. All others import what they hand out.
"""

import re
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Final

_OURS: Final = {"TYPE_CHECKING", "lazy_exports", "old_names"}
_IMPORT: Final = re.compile(r"^ +from (\S+) import (\([^)]*\)|.+)", re.MULTILINE)
_HANDED_OUT: Final = re.compile(r"\b(\w+) as \1\b")


def lazy_exports(
    package: str,
    file: str,
    otherwise: Callable[[str], object] | None = None,
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package.

    Args:
        package: Its ``__name__``.
        file: Its ``__file__``, which says where each of its names is.
        otherwise: Asked for what none of them holds, such as :func:`old_names`.
    """
    with open(file, encoding="utf-8") as text:
        imports = _IMPORT.findall(text.read())
    home = {name: module for module, names in imports for name in _HANDED_OUT.findall(names)}

    def load(name: str) -> object:
        if name not in home:
            if otherwise is not None:
                return otherwise(name)
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(home[name]), name)
        setattr(sys.modules[package], name, value)  # the next use finds it at once
        return value

    def listed() -> list[str]:
        return sorted({*vars(sys.modules[package]), *home} - _OURS)

    return load, listed, sorted(home)


def old_names(package: str) -> Callable[[str], object]:
    """Return the ``__getattr__`` of a package that names have left (:mod:`robolink.deprecation`).

    Args:
        package: Its ``__name__``.
    """

    def find(name: str) -> object:
        from robolink.deprecation import under_old_name

        return under_old_name(package, name)

    return find
