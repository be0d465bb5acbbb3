"""plate-touch: a third-party calibration method; a small copy of z-touch."""

from robolink.messages import tr
from robolink.methods import Method, Needs, Site
from robolink.procedures import TipSource
from robolink.stations import StationKind, touch_station
from tests.contract.plate_touch.parameters import PlateTouchParameters


def _source(parameters: PlateTouchParameters, site: Site) -> TipSource:
    from tests.contract.plate_touch.source import PlateTouchSource

    return PlateTouchSource(touch_station(site.station), parameters, site.sigma_mm)


METHOD = Method(
    name="plate-touch",
    summary=tr("Touch a plate twice: Z."),
    description=tr("Touch a plate twice: Z.\n\nNobody touches anything."),
    parameters=PlateTouchParameters,
    measures=("z_mm",),
    needs=Needs(
        station=StationKind.TOUCH,
        place=(
            tr("where to touch"),
            tr("the plate"),
        ),
    ),
    source=_source,
    tells_height=True,
)
