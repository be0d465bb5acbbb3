"""The calibration methods: those of robolink, and those of plug-ins.

A package brings one by an entry point of the group ``robolink.methods``, whose name is the
method's and which leads to its :class:`~robolink.methods.Method`; :func:`register` takes the
object itself.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module, metadata
from typing import Final, cast

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink.methods.method import AnyMethod
from robolink.plug_ins import PlugInError, find_plug_in

METHODS_GROUP: Final = "robolink.methods"

_OWN: Final = {
    "two-pose": "robolink.methods.two_pose",
    "n-angle": "robolink.methods.n_angle",
    "one-touch": "robolink.methods.one_touch",
    "beams": "robolink.methods.beams",
    "z-touch": "robolink.methods.z_touch",
    "camera": "robolink.methods.camera",
    "camera-affine": "robolink.methods.camera_affine",
    "board": "robolink.methods.board",
    "runout-table": "robolink.methods.runout_table",
    "pivot": "robolink.methods.pivot",
    "six-point": "robolink.methods.pivot.six_point",
    "plane-touch": "robolink.methods.surface_touch.plane",
    "sphere-touch": "robolink.methods.surface_touch.sphere",
    "points": "robolink.methods.points",
}
"""Module of each method, by name, in the order of the help page."""

_registered: dict[str, AnyMethod] = {}


@cache
def _brought(_path: tuple[str, ...]) -> metadata.EntryPoints:
    """Return the plug-ins of installed packages; searching all packages takes long."""
    return metadata.entry_points(group=METHODS_GROUP)


@cache
def _own(name: str) -> AnyMethod:
    """Return one of ours; a change asks for its method many times."""
    own: AnyMethod = import_module(_OWN[name]).METHOD
    return own


def method_names() -> tuple[str, ...]:
    """Return the names of all methods, in the order of the help page."""
    return tuple(dict.fromkeys((*_OWN, *sorted(_brought(tuple(sys.path)).names), *_registered)))


def find_method(name: str) -> AnyMethod:
    """Return the method of that name.

    Raises:
        ConfigError: There is none, or what a package brings cannot be used.
    """
    if name in _registered:
        return _registered[name]
    if name in _OWN:
        return _own(name)
    try:
        found = find_plug_in(METHODS_GROUP, name)
    except PlugInError as error:
        raise ConfigError(
            tr(
                "The calibration method {name!r} cannot be loaded: {cause}.", name=name, cause=error
            ),
            remedy=tr("Reinstall the package that provides it."),
        ) from error.origin
    if found is None:
        raise ConfigError(
            tr("There is no calibration method {name!r}.", name=name),
            remedy=known_names(method_names(), name),
        )
    return cast(AnyMethod, found)


def all_methods() -> tuple[AnyMethod, ...]:
    """Return all methods, in the order of the help page."""
    return tuple(find_method(name) for name in method_names())


@contextmanager
def register(method: AnyMethod) -> Iterator[None]:
    """Add a method within the block: as a command, and as a kind of a recipe's source."""
    if method.name in method_names():
        raise ValueError(f"there is a method {method.name!r} already")
    _registered[method.name] = method
    try:
        yield
    finally:
        del _registered[method.name]
