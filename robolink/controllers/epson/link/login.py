"""What an unanswered or a refused login means; apart, since a stop needs none of the answers."""

from typing import Final

from robolink.errors import LoginRefusedError, LoginUnansweredError
from robolink.messages import tr
from robolink.ways import Way, way

PASSWORD_REFUSALS: Final = (13, 98)
"""The password is wrong, or one is demanded (docs/reference/epson.md 1.6)."""


def unanswered(controller: str) -> LoginUnansweredError:
    """Return the error for a controller that is reached and does not answer the login."""
    return LoginUnansweredError(
        tr("{identity} can be reached, but does not answer the login.", identity=controller),
        remedy=tr(
            "Only one client may be logged in: close the other one. If there is none, "
            "check that this port is the controller's Remote Ethernet port."
        ),
        controller=controller,
        request="Login",
    )


def refused(code: int, controller: str) -> LoginRefusedError:
    """Return the error for a password that the controller does not take."""
    return LoginRefusedError(
        tr("The controller refused the login (code {code}).", code=code),
        code=code,
        remedy=tr(
            "Give the password that is set on the controller's Remote Ethernet page: "
            "{password}. No second attempt was made.",
            password=way(Way.PASSWORD),
        ),
        controller=controller,
        request="Login",
    )
