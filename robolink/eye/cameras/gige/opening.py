"""Opens a GigE Vision camera by its address, its serial number or its name."""

import socket
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.errors import CalibrationError, ConfigError
from robolink.eye.cameras.gige.aravis import DEVICE_ERRORS, Aravis, AravisError, aravis
from robolink.eye.cameras.gige.gvcp import CONTROL, EXCLUSIVE, gvcp_channel, privilege
from robolink.eye.cameras.gige.refusals import camera_gone, camera_taken
from robolink.eye.cameras.gige.source import ACCESS_DENIED, PATIENCE_S, GigeSource
from robolink.messages import tr
from robolink.timing import Clock

__all__ = ["FoundCamera", "located", "open_gige"]

EXAMPLE: Final = "gige://192.168.1.20"


@dataclass(frozen=True, slots=True)
class FoundCamera:
    """A camera on the network.

    Attributes:
        address: Its IPv4 address.
        names: By which one may ask for it: maker, model and serial number; that number; its MAC
            address.
    """

    address: str
    names: tuple[str, ...]

    def is_called(self, name: str) -> bool:
        """Return whether it is meant by a name, in small or capital letters."""
        return name.casefold() in (own.casefold() for own in self.names)


def open_gige(
    camera: str, *, patience_s: float = PATIENCE_S, clock: Clock | None = None
) -> GigeSource:
    """Open a GigE Vision camera, which then belongs to this program until it is closed.

    Args:
        camera: Its IPv4 address, serial number, name (maker, model and serial number) or MAC
            address; empty for the only one there is.
        patience_s: How long a picture may take from its trigger, besides its exposure.
        clock: What the times of a picture are read from.

    Raises:
        ConfigError: The library is missing; or the camera is not the only one that is meant.
        CalibrationError: ``camera_gone`` or ``camera_taken``.
    """
    library = aravis()
    address = camera if _is_address(camera) else located(camera, _cameras(library))
    source = _opened(library, address, patience_s, clock)
    try:
        source.prepare()
    except BaseException:
        source.close()
        raise
    return source


def _opened(library: Aravis, address: str, patience_s: float, clock: Clock | None) -> GigeSource:
    held = privilege(address)
    if held is None:
        raise camera_gone(address)
    if held & (CONTROL | EXCLUSIVE):
        raise camera_taken(address)
    with gvcp_channel(address) as channel:
        own_address = channel.own_address
    ends = [
        library.call("g_inet_address_new_from_string", end.encode("ascii"))
        for end in (own_address, address)
    ]
    try:
        device = library.checked("arv_gv_device_new", *ends)
    except AravisError as error:
        denied = error.domain == DEVICE_ERRORS and error.code == ACCESS_DENIED
        raise (camera_taken(address) if denied else camera_gone(address, str(error))) from error
    finally:
        for end in ends:
            library.let_go(end)
    if not library.call("arv_gv_device_is_controller", device):
        library.let_go(device)
        raise camera_taken(address)
    try:
        camera = library.checked("arv_camera_new_with_device", device)
    except AravisError as error:
        library.let_go(device)
        raise camera_gone(address, str(error)) from error
    return GigeSource(library, camera, device, address, patience_s=patience_s, clock=clock)


def located(camera: str, there: Sequence[FoundCamera]) -> str:
    """Return the address of a camera that was asked for by name.

    Args:
        camera: Its name; empty for the only one.
        there: Those that answer.

    Raises:
        ConfigError: Several are meant.
        CalibrationError: ``camera_gone``: none is.
    """
    meant = [found for found in there if not camera or found.is_called(camera)]
    if len(meant) == 1:
        return meant[0].address
    names = ", ".join(f"{found.names[0]} ({found.address})" for found in meant or there)
    if meant:
        raise ConfigError(
            tr("Several GigE cameras answer: {cameras}.", cameras=names),
            remedy=tr(
                "Name one by its serial number or its address, such as {example}.", example=EXAMPLE
            ),
        )
    if there:
        raise CalibrationError(
            "camera_gone",
            tr(
                "No GigE camera {camera} answers; these do: {cameras}.",
                camera=camera,
                cameras=names,
            ),
            remedy=tr("Correct the camera's URL, or switch the camera on."),
        )
    raise (
        camera_gone(camera)
        if camera
        else CalibrationError(
            "camera_gone",
            tr("No GigE camera answers on this computer's networks."),
            remedy=tr(
                "Check its power and cable, or give its address, such as {example}.",
                example=EXAMPLE,
            ),
        )
    )


def _cameras(library: Aravis) -> list[FoundCamera]:
    """Return the cameras that answer a broadcast on this computer's networks, by name."""
    interface = library.call("arv_gv_interface_get_instance")
    library.call("arv_interface_update_device_list", interface)
    found = list[FoundCamera]()
    for at in range(library.call("arv_interface_get_n_devices", interface)):
        address, *names = (
            (library.call(f"arv_interface_get_device_{what}", interface, at) or b"").decode(
                "utf-8", "replace"
            )
            for what in ("address", "id", "serial_nbr", "physical_id")
        )
        found.append(FoundCamera(address, tuple(names)))
    return sorted(found, key=lambda one: one.names)


def _is_address(camera: str) -> bool:
    try:
        socket.inet_pton(socket.AF_INET, camera)
    except OSError:
        return False
    return True
