"""one-touch: a pin whose place is known, touched once."""

from typing import TYPE_CHECKING

from robolink.messages import declared, tr
from robolink.methods.declaration.method import Former, Method, Needs, PoseHelp
from robolink.methods.declaration.site import Site
from robolink.methods.one_touch.parameters import OneTouchParameters
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.methods.one_touch.solvers import Absolute, Difference
    from robolink.procedures import MovingSource, PoseMethod, TipSource


def _solver(parameters: OneTouchParameters, site: Site) -> "Absolute | Difference":
    """Return how the touch is used.

    Raises:
        CalibrationError: ``no_last_touch`` or ``reference_outdated``.
        ConfigError: Nobody knows where the pin is, or nothing tells how well a touch repeats.
    """
    from robolink.calibration import NeedleLimits
    from robolink.methods.one_touch.solvers import Absolute, difference_from_last
    from robolink.stations import pin_of

    if parameters.basis == "absolute":
        # Whoever does not know how sure the pin is cannot say how sure the tip is.
        return Absolute(pin_of(site.station), site.sigma_mm if site.station.sigma_mm else None)
    limits = NeedleLimits(
        max_change_mm=site.max_change_mm,
        tolerance_mm=site.interval_mm or NeedleLimits().tolerance_mm,
        max_changes=parameters.max_changes,
    )
    return difference_from_last(
        site.controller, site.tool, site.station.id, sigma_mm=site.sigma_mm, limits=limits
    )


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
)
