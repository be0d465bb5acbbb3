"""After the looks: what they say, and the one that fits worst taken again if a person wants it."""

from collections.abc import Callable, Sequence
from typing import TypeVar

from robolink.calibration._camera_drive import CameraDrive, Place
from robolink.calibration._many_touches import MOST_RETAKES, worst_pose
from robolink.calibration._result import CalibrationResult
from robolink.calibration._steps import Offer, Procedure, SeenAt
from robolink.messages import tr

ResultT = TypeVar("ResultT", bound=CalibrationResult)


def settled(
    drive: CameraDrive,
    places: Sequence[Place],
    seen: Sequence[SeenAt],
    solve: Callable[[Sequence[SeenAt]], ResultT],
    *,
    retake: bool,
) -> Procedure[ResultT]:
    """Return what the looks say, after a person had the worst of them taken again or not.

    Args:
        drive: Takes the looks; stands before the camera, at the last place.
        places: Where the looks were taken.
        seen: The looks.
        solve: What they say.
        retake: Whether a look is offered to be taken again. It ends lifted in any case.

    Raises:
        CalibrationError: Those of ``solve``, and of :meth:`CameraDrive.looks`.
    """
    looks, last = list(seen), places[-1]
    yield from drive.lifted(last)
    result = solve(looks)
    for _ in range(MOST_RETAKES if retake and result.dof else 0):
        worst = worst_pose(result)
        if not (yield Offer(_offer(result, worst))):
            break
        here = drive.above(last)
        last = places[worst]
        (looks[worst],) = yield from drive.looks([last], here)
        yield from drive.lifted(last)
        result = solve(looks)
    return result


def _offer(result: CalibrationResult, worst: int) -> str:
    return tr(
        "Look {number}, at U {u:.1f}, fits worst: it is {distance:.3f} mm off. Take it again?",
        number=worst + 1,
        u=result.inputs[worst].u_deg,
        distance=result.residual_distances_mm[worst],
    )
