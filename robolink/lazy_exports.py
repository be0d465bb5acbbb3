"""Packages whose names are loaded at first use (PEP 562).

A stop, a status and ``--help`` may not pay for what they do not use. A package that one of them
passes, and whose names need more than they do, lists its names once for readers and the type
checker, under ``TYPE_CHECKING``, and once for the running program; a test compares the two lists.
All others import what they hand out.
"""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Final

_OURS: Final = {"TYPE_CHECKING", "lazy_exports", "old_names"}


def lazy_exports(
    package: str,
    homes: Mapping[str, str],
    otherwise: Callable[[str], object] | None = None,
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package.

    Args:
        package: Its ``__name__``.
        homes: Module of the package, without its leading name, to the names that it holds,
            separated by blanks.
        otherwise: Asked for what none of them holds, such as :func:`old_names`.
    """
    home = {name: module for module, names in homes.items() for name in names.split()}

    def load(name: str) -> object:
        if name not in home:
            if otherwise is not None:
                return otherwise(name)
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(f"{package}.{home[name]}"), name)
        setattr(sys.modules[package], name, value)  # the next use finds the name at once
        return value

    def listed() -> list[str]:
        return sorted({*vars(sys.modules[package]), *home} - _OURS)

    return load, listed, sorted(home)


def old_names(package: str) -> Callable[[str], object]:
    """Return the ``__getattr__`` of a package that exports old names (:mod:`robolink.deprecation`).

    Args:
        package: Its ``__name__``.
    """

    def find(name: str) -> object:
        from robolink.deprecation import under_old_name

        return under_old_name(package, name)

    return find
