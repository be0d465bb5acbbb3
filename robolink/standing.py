"""The old name of :mod:`robolink.controller_outcome`: it works for one more version, and warns."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
