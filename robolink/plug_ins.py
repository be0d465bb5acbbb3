"""Plug-ins of installed packages: transports, controllers, methods, sensors, by entry points."""

from collections.abc import Iterator
from dataclasses import dataclass
from traceback import walk_tb
from typing import Final

from robolink.messages import tr

_OURS: Final = frozenset({"robolink", "robolink_cli", "robolink_simulators"})


class PlugInError(Exception):
    """A plug-in cannot be used; the text says why. The caller adds what it is."""

    @property
    def origin(self) -> BaseException:
        """The error of Python when it was loaded; else this error itself."""
        return self.__cause__ or self


def find_plug_in(group: str, name: str) -> object | None:
    """Return what a package provides under a name, ``None`` if none provides it.

    Args:
        group: The group of entry points.
        name: The name in it.

    Raises:
        PlugInError: It cannot be loaded, or several packages bring one: nobody may guess which
            of them drives a machine.
    """
    from importlib import metadata  # slow to import, so only when used

    found = tuple(metadata.entry_points(group=group, name=name))
    if not found:
        return None
    # A package installed twice (an editable copy beside a wheel) gives the same entry point.
    if len(found) > 1 and len({entry.value for entry in found}) > 1:
        raise PlugInError(tr("several packages provide it"))
    try:
        return found[0].load()  # type: ignore[no-any-return]
    except (ImportError, AttributeError) as error:
        raise PlugInError(str(error)) from error
    except Exception as error:  # loading runs the plug-in's module, which may raise anything
        raise PlugInError(f"{type(error).__name__}: {error}") from error


@dataclass(frozen=True, slots=True)
class PlugInModule:
    """Where an error came from that is not robolink's.

    Attributes:
        name: The module that robolink called.
        package: The installed package that brings it, with its version.
    """

    name: str
    package: str


def plug_in_module(error: BaseException) -> PlugInModule | None:
    """Return the plug-in that raised ``error``, ``None`` if robolink itself did.

    That is the one that robolink called last, whatever that called in turn.
    """
    called: list[str] = []
    for frame, _ in walk_tb(error.__traceback__):
        name = str(frame.f_globals.get("__name__", ""))
        if _top(name) in _OURS:
            called.clear()
        else:
            called.append(name)
    if not called:
        return None
    packages = dict(_packages_of_plug_ins())
    return next(
        (PlugInModule(name, packages[_top(name)]) for name in called if _top(name) in packages),
        None,
    )


def unexpected(error: BaseException) -> str:
    """Return a sentence for an unexpected error, with its origin."""
    kind, module = type(error).__name__, plug_in_module(error)
    if module is None:
        return tr("A defect in robolink: {kind}: {error}", kind=kind, error=error)
    return tr(
        "{module}, of the installed package {package}, failed: {kind}: {error}",
        module=module.name,
        package=module.package,
        kind=kind,
        error=error,
    )


def _packages_of_plug_ins() -> Iterator[tuple[str, str]]:
    """Yield the outermost module of each plug-in, and the package that provides it."""
    from importlib import metadata

    for package in metadata.distributions():
        for entry in package.entry_points:
            if entry.group.startswith("robolink.") and _top(entry.module) not in _OURS:
                yield _top(entry.module), f"{package.name} {package.version}"


def _top(module: str) -> str:
    return module.partition(".")[0]
