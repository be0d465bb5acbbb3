"""Which robolink this is."""

from typing import Final

VERSION: Final = "0.1.0"
"""Same version as in ``pyproject.toml``; a test compares them."""
