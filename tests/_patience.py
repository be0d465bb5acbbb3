"""The longest time that a test waits for an event that must happen."""

from typing import Final

PATIENCE_S: Final = 120.0
"""Such a wait ends as soon as the event happens; only a missing event takes this long. On a busy
computer a process may get a hundredth of its usual CPU time.
"""
