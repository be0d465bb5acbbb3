"""camera-affine: an up-looking camera of unknown pose, found together with the tip."""

from dataclasses import replace
from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.camera_affine.parameters import CameraAffineParameters
from robolink.methods.declaration.look_parameters import PLACE, UNMEASURED_Z, camera_at
from robolink.methods.declaration.method import Former, Method, Needs
from robolink.methods.declaration.site import Site
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import TipSource


def _source(parameters: CameraAffineParameters, site: Site) -> "TipSource":
    from robolink.methods.camera_affine.source import CameraAffineSource

    sensor, station = camera_at(parameters, site)
    if parameters.new_camera:
        station = replace(station, model=None)
    return CameraAffineSource(
        sensor, station, parameters, sigma_mm=site.sigma_mm, name=site.station.id
    )


METHOD = Method(
    name="camera-affine",
    summary=declared("Find an up-looking camera and the tip together."),
    description=declared(
        "Find an up-looking camera and the tip together: X and Y, scale, turn and mirror.\n\n"
        "Say to the command, or in the cell file, where the camera looks to within its field of "
        "view. The tip goes to four corners of the image and turns in its middle. What was found "
        "is kept on record under the name of the station; a camera that is not as it was is "
        "refused."
    ),
    parameters=CameraAffineParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.CAMERA, sensor=True, place=PLACE),
    source=_source,
    unmeasured_z=UNMEASURED_Z,
    formerly=(Former(kind="camera_affine"),),
)
