"""The garbage collector of a process that only serves simulated controllers.

Theory of operation. A full collection looks at every object of every controller, some hundred
each: 90 ms for a thousand, in which none of them answers. What has survived one that is not full
mostly lives as long as the process. So that is set aside at once (``gc.freeze``), and the next one
looks only at what came since, in 2 ms at most; full ones are not due any more, since the collector
counts anew. A controller that is made anew leaves garbage among what is set aside; so when that
has doubled nothing is set aside until the collector has looked at all of it, which keeps garbage
below what is in use.
"""

import gc
from collections.abc import Mapping
from typing import Any, Final

_SPARE: Final = 200_000
"""Number of frozen objects, beyond twice those in use, at which the collector examines all of them
again.
"""

_USUAL: Final = (700, 2000)
"""Threshold with which CPython begins, up to 3.12 and from 3.13 on."""

_YOUNGEST: Final = 0
_OLDEST: Final = 2


class RareFullCollections:
    """While it is entered, what survives a collection of this process is set aside.

    For a program of which serving is all it does, as ``robolink sim``: it changes the collector
    of a whole process. So nothing that runs inside of somebody else's does so, neither fixtures
    nor ``sim://``. Where something is set aside already, or the threshold is not CPython's own, its
    owner has decided, and nothing is done.

    Args:
        spare: So many objects may be set aside besides twice those in use.

    Attributes:
        thaws: How often all of it was looked at again.
    """

    def __init__(self, spare: int = _SPARE) -> None:
        self.thaws = 0
        self._spare = spare
        self._in_use = self._set_aside = 0
        self._thawed = self._decided = False

    def __enter__(self) -> "RareFullCollections":
        # The threshold first: counting what somebody has set aside takes 100 ns for each object.
        self._decided = gc.get_threshold()[0] in _USUAL and gc.get_freeze_count() == 0
        if self._decided:
            gc.freeze()
            self._in_use = self._set_aside = gc.get_freeze_count()
            gc.callbacks.append(self._at_collection)
        return self

    def __exit__(self, *_details: object) -> None:
        if self._decided:
            gc.callbacks.remove(self._at_collection)
            gc.unfreeze()

    def _at_collection(self, phase: str, info: Mapping[str, Any]) -> None:
        if phase == "start" or info["generation"] == _YOUNGEST:
            return
        if not self._thawed:
            self._set_survivors_aside()
        elif info["generation"] == _OLDEST:
            self._thawed = False
            gc.freeze()
            self._in_use = self._set_aside = gc.get_freeze_count()

    def _set_survivors_aside(self) -> None:
        self._set_aside += len(gc.get_objects(_OLDEST))
        gc.freeze()
        most = 2 * self._in_use + self._spare
        if self._set_aside > most:
            # Some objects are freed without the collector. Counting 200,000 takes 20 ms.
            self._set_aside = gc.get_freeze_count()
            if self._set_aside > most:
                self._thawed = True
                self.thaws += 1
                gc.unfreeze()
