"""The cameras of simulated cells, as plug-ins of the group ``robolink.sensors``.

``epson+sim://NAME`` and ``softmotion+sim://NAME`` look into a simulator of this process,
``assist+tcp://TOKEN@127.0.0.1:PORT`` into a served one, through its assist port. All answer in
pixels.
"""

from collections.abc import Callable, Sequence
from typing import Final
from urllib.parse import urlsplit

from robolink.model import TIP, Spot, SpotUnit
from robolink_simulators.control.assist import AssistClient, simulator_at

SETTLE_S: Final = 0.1
"""Time in seconds for which the robot must stand still before the simulated camera takes a picture
(assumed).
"""

Picture = Callable[[int], Sequence[tuple[float, float, float | None]]]
"""Takes a picture of a mark. Returns X, Y and radius in pixels of each spot; ``None`` for no
radius.
"""


class SimulatedCamera:
    """Implements :class:`~robolink.model.TipSensor` on the picture of a world.

    Args:
        identity: The URL.
        picture: Takes one, for a mark.
        resolution_px: Of the image.
        close: What is to be done at the end.
    """

    def __init__(
        self,
        identity: str,
        picture: Picture,
        *,
        resolution_px: tuple[int, int],
        close: Callable[[], None] = lambda: None,
    ) -> None:
        self._identity = identity
        self._picture = picture
        self._resolution_px = resolution_px
        self._close = close

    @property
    def identity(self) -> str:
        """The URL."""
        return self._identity

    @property
    def unit(self) -> SpotUnit:
        """Pixels."""
        return SpotUnit.PIXEL

    @property
    def resolution_px(self) -> tuple[int, int] | None:
        """Width and height of the image."""
        return self._resolution_px

    @property
    def settle_s(self) -> float:
        """Seconds of the controller's clock."""
        return SETTLE_S

    def see(self, mark: int = TIP) -> Sequence[Spot]:
        """Take a picture; see :class:`~robolink.model.TipSensor`."""
        return [Spot(x, y, radius_px=radius_px) for x, y, radius_px in self._picture(mark)]

    def close(self) -> None:
        """Release it."""
        self._close()


def open_in_process(url: str) -> SimulatedCamera:
    """Open the camera beside a simulator of this process.

    Raises:
        ConfigError: No simulator has that name.
    """
    simulator = simulator_at(url)

    def picture(mark: int) -> Sequence[tuple[float, float, float | None]]:
        with simulator.lock:
            return simulator.world.spots(mark)

    size_px = simulator.world.camera.optics.size_px
    return SimulatedCamera(_identity(url), picture, resolution_px=size_px)


def open_served(url: str) -> SimulatedCamera:
    """Open the camera beside a served simulator.

    Raises:
        ConfigError: It is not an assist URL.
        ConnectError: Nobody listens there.
    """
    client = AssistClient(url)
    width, height = client.truth()["camera"]["size_px"]
    return SimulatedCamera(
        _identity(url), client.see, resolution_px=(width, height), close=client.close
    )


def _identity(url: str) -> str:
    parts = urlsplit(url)
    # Without the token of the assist port: this text goes into messages and records.
    return f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}"
