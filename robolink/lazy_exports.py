"""Packages whose names are loaded when they are first used (PEP 562).

A stop, a status and ``--help`` may not pay for what they do not use. A package that takes part
lists its names once for readers and the type checker, under ``TYPE_CHECKING``, and once for the
running program; a test compares the two lists.
"""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module


def lazy_exports(package: str, homes: Mapping[str, str]) -> Callable[[str], object]:
    """Return the ``__getattr__`` of a package.

    Args:
        package: Its ``__name__``.
        homes: Module of the package, without its leading name, to the names that it holds,
            separated by blanks.
    """
    home = {name: module for module, names in homes.items() for name in names.split()}

    def load(name: str) -> object:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(f"{package}.{home[name]}"), name)
        setattr(sys.modules[package], name, value)  # the next use finds it at once
        return value

    return load
