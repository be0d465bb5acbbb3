"""PLCs that keep tool offsets in the machine builder's own registers."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
