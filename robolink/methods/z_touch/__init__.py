"""z-touch: a surface that switches an input when a tip touches it."""

from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.declaration.method import Former, Method, Needs
from robolink.methods.declaration.site import Site
from robolink.methods.z_touch.parameters import ZTouchParameters
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import KeptProof, TipSource


def _source(parameters: ZTouchParameters, site: Site) -> "TipSource":
    from robolink.methods.z_touch.source import ZTouchSource
    from robolink.stations import touch_station

    stated = parameters.input is not None
    station = site.stating(
        input=parameters.input, off_when_touched=parameters.off_when_touched if stated else None
    )
    return ZTouchSource(touch_station(station), parameters, sigma_mm=site.sigma_mm)


def _proof() -> "type[KeptProof]":
    from robolink.methods.z_touch.proof import ProbeTest

    return ProbeTest


METHOD = Method(
    name="z-touch",
    summary=declared("Touch a surface that switches an input: Z."),
    description=declared(
        "Touch a surface that switches an input: Z; nobody touches anything.\n\n"
        "X and Y are kept. The tip stops at the touch and retreats; two speeds tell the latency. "
        "After each touch from the third on it says how well they agree and what Z is repeatable "
        "to; at the end the one that fits worst is named and may be made again."
    ),
    parameters=ZTouchParameters,
    measures=("z_mm",),
    needs=Needs(
        station=StationKind.TOUCH,
        place=(
            declared("where to touch"),
            declared("the surface"),
        ),
    ),
    source=_source,
    tells_height=True,
    formerly=(Former(kind="touch"),),
    proof=_proof,
)
