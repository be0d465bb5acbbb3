"""A stop beside a running robolink: who has the controller, and what a stop leaves behind.

``stop_now`` of :mod:`robolink.controllers` stops a controller that can be reached. Here is what
stands around it: the listener of a process that holds one, how a second terminal finds and asks
it, how one that is silent is ended, and the note by which the next command learns of the stop.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports, old_names

if TYPE_CHECKING:
    from robolink.stopping._asking import ControllerHolder as ControllerHolder
    from robolink.stopping._asking import HolderGoneError as HolderGoneError
    from robolink.stopping._asking import LastSeen as LastSeen
    from robolink.stopping._asking import await_brief_holders as await_brief_holders
    from robolink.stopping._asking import holders_of as holders_of
    from robolink.stopping._ending import end_process as end_process
    from robolink.stopping._ending import may_be_ended as may_be_ended
    from robolink.stopping._listener import SharedStopListener as SharedStopListener
    from robolink.stopping._listener import StopListener as StopListener
    from robolink.stopping._listener import no_place_to_listen as no_place_to_listen
    from robolink.stopping._notes import StopNote as StopNote
    from robolink.stopping._notes import clear_note as clear_note
    from robolink.stopping._notes import find_note as find_note
    from robolink.stopping._notes import leave_note as leave_note
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_asking": "ControllerHolder HolderGoneError LastSeen await_brief_holders holders_of",
            "_ending": "end_process may_be_ended",
            "_listener": "SharedStopListener StopListener no_place_to_listen",
            "_notes": "StopNote clear_note find_note leave_note",
        },
        old_names(__name__),
    )
