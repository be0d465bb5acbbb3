"""camera: a calibrated, up-looking camera sees the tip."""

from typing import TYPE_CHECKING

from robolink.messages import declared
from robolink.methods.camera.parameters import CameraParameters
from robolink.methods.declaration.look_parameters import PLACE, UNMEASURED_Z, camera_at
from robolink.methods.declaration.method import Method, Needs
from robolink.methods.declaration.site import Site
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import KeptProof, TipSource


def _source(parameters: CameraParameters, site: Site) -> "TipSource":
    from robolink.methods.camera.source import CameraSource

    sensor, station = camera_at(parameters, site)
    return CameraSource(
        sensor, station, parameters.look, sigma_mm=site.sigma_mm, retake=parameters.retake
    )


def _proof() -> "type[KeptProof]":
    from robolink.methods.camera.proof import LookTest

    return LookTest


METHOD = Method(
    name="camera",
    summary=declared("See the tip with a calibrated, up-looking camera: X and Y."),
    description=declared(
        "See the tip with an up-looking camera: X and Y; nobody touches anything.\n\n"
        "What a pixel means is known from 'calibrate camera-affine', or stands in the cell file, "
        "or the camera answers in millimetres. Looks at several angles tell the tip from what the "
        "camera itself is off by; a single one believes the camera."
    ),
    parameters=CameraParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.CAMERA, sensor=True, place=PLACE),
    source=_source,
    unmeasured_z=UNMEASURED_Z,
    proof=_proof,
)
