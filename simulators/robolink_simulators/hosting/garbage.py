"""The garbage collector of a process that does nothing but serve simulated controllers.

Theory of operation. A full collection looks at every object of every controller, some hundred
each: 90 ms for a thousand, in which none of them answers. What has survived one mostly lives as
long as the process. So what survives is set aside (``gc.freeze``), and the next one looks only at
what came since. A controller that is made anew leaves garbage among what is set aside; so when
that has doubled all of it is looked at again, which keeps garbage below what is in use.
"""

import gc
from collections.abc import Mapping
from typing import Any, Final

_SPARE: Final = 200_000
"""So many objects are set aside besides twice those in use before all are looked at again."""

_FULL: Final = 2


class RareFullCollections:
    """While it is entered, what survives a full collection of this process is set aside.

    For a program of which serving is all it does, as ``robolink sim``: it changes the collector
    of a whole process. So nothing that runs inside of somebody else's does so, neither fixtures
    nor ``sim://``. Where something is set aside already its owner has decided, and nothing is done.

    Args:
        spare: So many objects may be set aside besides twice those in use.

    Attributes:
        thaws: How often all of it was looked at again.
    """

    def __init__(self, spare: int = _SPARE) -> None:
        self.thaws = 0
        self._spare = spare
        self._in_use = 0
        self._thawed = self._decided = False

    def __enter__(self) -> "RareFullCollections":
        self._decided = gc.get_freeze_count() == 0
        if self._decided:
            gc.freeze()
            self._in_use = gc.get_freeze_count()
            gc.callbacks.append(self._at_collection)
        return self

    def __exit__(self, *_details: object) -> None:
        if self._decided:
            gc.callbacks.remove(self._at_collection)
            gc.unfreeze()

    def _at_collection(self, phase: str, info: Mapping[str, Any]) -> None:
        if info["generation"] != _FULL:
            return
        if phase == "start":
            self._thawed = gc.get_freeze_count() > 2 * self._in_use + self._spare
            if self._thawed:
                gc.unfreeze()
                self.thaws += 1
        else:
            gc.freeze()
            if self._thawed:
                self._in_use = gc.get_freeze_count()
