"""CODESYS SoftMotion PLCs behind the robolink mailbox."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.controllers.softmotion._controller import (
        SoftMotionController as SoftMotionController,
    )
    from robolink.controllers.softmotion._device import read_device_id as read_device_id
    from robolink.controllers.softmotion._facts import MailboxFacts as MailboxFacts
    from robolink.controllers.softmotion._jog import Jog as Jog
    from robolink.controllers.softmotion._open import open_softmotion as open_softmotion
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "_controller": "SoftMotionController",
            "_device": "read_device_id",
            "_facts": "MailboxFacts",
            "_jog": "Jog",
            "_open": "open_softmotion",
        },
    )
