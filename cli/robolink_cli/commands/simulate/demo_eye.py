"""The drawn camera of a demonstrated cell: pictures over HTTP, and tips that are found in them."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field

from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.pictures.camera import DrawnCamera
from robolink_simulators.pictures.server import PictureServer
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.eye.eye_camera import EyeCamera
from robolink.eye.opening import open_source
from robolink.messages import tr
from robolink.methods import CameraAffineSource
from robolink.stations import CameraStation
from robolink_cli.console.render import say

_PLACED_MM = (0.4, -0.3)
"""How far from the middle of the picture a person puts the station, in X and Y."""


@dataclass(slots=True)
class DemoEye:
    """An eye on a demonstrated cell.

    Attributes:
        pictures: How many pictures were taken.
    """

    simulator: EpsonSimulator | SoftMotionSimulator
    pictures: int = field(default=0, init=False)

    @contextmanager
    def source(self) -> Iterator[CameraAffineSource]:
        """Serve the pictures of the cell for the block, and give what finds camera and tip in them.

        Nothing is known of the camera but where it stands, roughly, and how wide a tip looks, which
        'cell station learn' teaches.
        """
        world = self.simulator.world
        x_mm, y_mm, z_mm = world.camera.middle_mm
        diameter_mm = world.parameters.tip_diameter_mm
        radius_px = 500 * diameter_mm / world.parameters.camera_um_per_px_x
        station = CameraStation(
            x_mm + _PLACED_MM[0],
            y_mm + _PLACED_MM[1],
            z_mm,
            details={"diameter_mm": diameter_mm, "radius_px": radius_px},
        )
        with PictureServer(DrawnCamera(self.simulator)) as server:
            # PGM, so that no package is needed. Nothing is kept of these pictures.
            with closing(EyeCamera(open_source(server.url("pgm")))) as eye:
                say(tr("Its camera delivers drawn pictures at {url}", url=server.url("png")))
                yield CameraAffineSource(eye, station)
            self.pictures = server.requests
