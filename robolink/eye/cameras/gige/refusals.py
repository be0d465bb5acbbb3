"""Why a GigE camera delivers no picture, by the codes of :mod:`robolink.eye.source`."""

from robolink.errors import CalibrationError
from robolink.messages import tr

__all__ = ["camera_gone", "camera_taken", "packets_lost", "unasked_pictures"]


def camera_gone(camera: str, cause: str = "") -> CalibrationError:
    """Return the error of a camera that does not answer, or not as one."""
    what = (
        tr("The GigE camera {camera} does not answer: {cause}.", camera=camera, cause=cause)
        if cause
        else tr("The GigE camera {camera} does not answer.", camera=camera)
    )
    return CalibrationError(
        "camera_gone",
        what,
        remedy=tr("Check its power, cable and address. It must be on this computer's network."),
    )


def camera_taken(camera: str) -> CalibrationError:
    """Return the error of a camera that belongs to another program."""
    return CalibrationError(
        "camera_taken",
        tr("Another program is using the GigE camera {camera}.", camera=camera),
        remedy=tr(
            "Close that program. If it was killed, wait 10 s: the camera is still waiting for it."
        ),
    )


def packets_lost(times: int) -> CalibrationError:
    """Return the error of pictures that arrive in part only."""
    return CalibrationError(
        "packets_lost",
        tr(
            "Parts of the picture were lost on the network, {times} times in a row.",
            times=times,
        ),
        remedy=tr(
            "Put the camera on a separate network, and enlarge this computer's buffer: "
            "sysctl -w net.core.rmem_max=4194304."
        ),
    )


def unasked_pictures() -> CalibrationError:
    """Return the error of a camera that something else triggers."""
    return CalibrationError(
        "stale_picture",
        tr("The camera sends pictures that robolink did not ask for, so their age is unknown."),
        remedy=tr("Switch the camera off and on, and disconnect other triggers."),
    )
