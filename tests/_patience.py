"""How long is waited for what certainly comes."""

from typing import Final

PATIENCE_S: Final = 120.0
"""Such a wait ends with what is waited for. Only what never comes takes this long: a computer that
does much else besides gives a process a hundredth of its time."""
