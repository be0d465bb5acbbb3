"""The named doubts of a measurement, as sentences."""

from collections.abc import Callable, Mapping
from typing import Final

from robolink.messages import tr
from robolink.nozzle_change import Proposal


def doubts(proposal: Proposal) -> tuple[str, ...]:
    """Return what a proposal leaves in doubt, as sentences."""
    known = (_SENTENCES.get(code) for code in dict.fromkeys(proposal.result.warnings))
    return tuple(sentence() for sentence in known if sentence is not None)


# Called late, because the language is chosen when a command runs.
_SENTENCES: Final[Mapping[str, Callable[[], str]]] = {
    "small_rotation": lambda: tr("The poses differ little in U; half a turn would be best."),
    "few_poses": lambda: tr("Few poses: four or more tell errors of placement from each other."),
    "large_rms": lambda: tr("The residuals are large for this method."),
    "large_residual": lambda: tr("One pose is far off; take it again."),
    "sigma_contradicted": lambda: tr(
        "The poses scatter more than the stated standard deviation says."
    ),
    "residuals_too_small": lambda: tr(
        "The poses agree better than the stated standard deviation allows: copied, or it was "
        "stated with care for the worst."
    ),
    "duplicate_poses": lambda: tr(
        "Some poses are copies of others, digit by digit; each counts once."
    ),
    "high_leverage": lambda: tr(
        "One pose alone decides: its own error leaves no trace. Take one more near it."
    ),
    "step_in_run_order": lambda: tr(
        "Something moved between two touches: pin, nozzle or robot. Take the run again."
    ),
    "drift_in_run_order": lambda: tr(
        "Something moved slowly during the touches. Take the run again."
    ),
    "camera_moved": lambda: tr(
        "The camera sees things beside where they are: it was moved, or its calibration is old."
    ),
    "unequal_scale": lambda: tr("The camera's two axes differ much in scale."),
    "large_shear": lambda: tr("The image is askew: the camera seems to lean."),
    "large_pixel_residual": lambda: tr("The looks agree within more than half a pixel only."),
    "turned_from_stored": lambda: tr(
        "An axis lies more than 45 degrees from where it is stored: make sure that +X and +Z were "
        "not taken for other axes. The proof by tilting does not show it."
    ),
    "ways_askew": lambda: tr(
        "The ways are further off a right angle than the touches scatter: the orientation is less "
        "sure than its interval says."
    ),
    "full_calibration_due": lambda: tr(
        "A full calibration is due: the differences since the last one add up."
    ),
}
"""Doubts that a caller says in other words are left out."""
