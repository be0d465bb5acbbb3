"""CODESYS SoftMotion PLCs behind the robolink mailbox."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.controllers.softmotion.controller import (
        SoftMotionController as SoftMotionController,
    )
    from robolink.controllers.softmotion.controller import open_softmotion as open_softmotion
    from robolink.controllers.softmotion.facts import MailboxFacts as MailboxFacts
    from robolink.controllers.softmotion.link.device import read_device_id as read_device_id
    from robolink.controllers.softmotion.motion.jog import Jog as Jog
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "controller": "SoftMotionController open_softmotion",
            "link.device": "read_device_id",
            "facts": "MailboxFacts",
            "motion.jog": "Jog",
        },
    )
