"""one-touch: a pin whose place is known, touched once."""

from dataclasses import replace
from typing import TYPE_CHECKING

from robolink.messages import declared, tr
from robolink.methods.declaration.method import Former, Method, Needs, PoseHelp
from robolink.methods.declaration.site import Site, ToolHistory
from robolink.methods.one_touch.parameters import OneTouchParameters
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.calibration import NeedleLimits
    from robolink.methods.one_touch.solvers import Absolute, Difference
    from robolink.procedures import MovingSource, PoseMethod, TipSource


def _solver(parameters: OneTouchParameters, site: Site) -> "Absolute | Difference":
    """Return how the touch is used.

    Raises:
        CalibrationError: ``no_last_touch`` or ``reference_outdated``.
        ConfigError: Nobody knows where the pin is, or nothing tells how well a touch repeats.
    """
    from robolink.methods.one_touch.solvers import Absolute, difference_from_last
    from robolink.stations import pin_of

    if parameters.basis == "absolute":
        # Whoever does not know how sure the pin is cannot say how sure the tip is.
        return Absolute(pin_of(site.station), site.sigma_mm if site.station.sigma_mm else None)
    limits = replace(_limits(parameters, site.interval_mm), max_change_mm=site.max_change_mm)
    return difference_from_last(
        site.controller, site.tool, site.station.id, sigma_mm=site.sigma_mm, limits=limits
    )


def _limits(parameters: OneTouchParameters, interval_mm: float | None) -> "NeedleLimits":
    from robolink.calibration import NeedleLimits

    return NeedleLimits(
        tolerance_mm=interval_mm or NeedleLimits().tolerance_mm, max_changes=parameters.max_changes
    )


def _changes_left(parameters: OneTouchParameters, history: ToolHistory) -> int | None:
    if parameters.basis == "absolute":
        return None
    from robolink.methods.one_touch.last_touch import newest_touch
    from robolink.methods.one_touch.solvers import left_of

    last = newest_touch(history.kept, history.station)
    if last is None or (history.holds is not None and history.holds != last.value):
        return None  # it would be refused, and says why then
    return left_of(last, history.sigma_mm, _limits(parameters, history.interval_mm))


def _source(parameters: OneTouchParameters, site: Site) -> "TipSource":
    from robolink.procedures import LazySource

    # The last touch is read when it is needed: a plan alone reads nothing.
    def make() -> "MovingSource":
        from robolink.methods.one_touch.source import OneTouchSource

        return OneTouchSource(_solver(parameters, site), parameters.touch)

    return LazySource(
        make,
        sentence=tr("measured on the robot: one pin touched once"),
        clearance_mm=parameters.clearance_mm,
    )


def _from_poses(parameters: OneTouchParameters, site: Site) -> "PoseMethod":
    return _solver(parameters, site)


METHOD = Method(
    name="one-touch",
    summary=declared("Touch a known pin once: X, Y and Z, for a change of the needle."),
    description=declared(
        "Touch a pin once: X, Y and Z of the new tip, for a change of the needle.\n\n"
        "The tool must have been calibrated on that pin before, for example with n-angle. What is "
        "written is the stored offset moved by how much the tip differs from the old "
        "one. The uncertainty adds up over such changes, until a full calibration is due."
    ),
    parameters=OneTouchParameters,
    measures=("x_mm", "y_mm", "z_mm"),
    needs=Needs(station=StationKind.PIN),
    source=_source,
    from_poses=_from_poses,
    pose_help=PoseHelp(
        points=declared("The one point taught on the pendant with the tip on the pin."),
        typed=declared("The pose X,Y,Z,U in mm and degrees with the tip on the pin."),
        path=declared("A file with the one pose."),
    ),
    by_reference=False,
    formerly=(Former(kind="one_touch"),),
    changes_left=_changes_left,
)
