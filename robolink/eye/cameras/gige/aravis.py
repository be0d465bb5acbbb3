"""Aravis, the free library for GigE Vision cameras, bound by ctypes as it is: no reasoning.

The library is installed beside robolink (docs/install.md) and loaded when a camera is opened, not
when this module is imported. Objects of the library are addresses, plain integers. What a function
takes and returns stands in one table, from the headers of Aravis 0.8.26 and GLib 2.74: without it
ctypes would cut an address to 32 bits.

The simulated camera is served by the same library, so it shares this module.
"""

import ctypes
import sys
from collections.abc import Mapping, Sequence
from ctypes import (
    POINTER,
    c_char_p,
    c_double,
    c_int,
    c_size_t,
    c_uint,
    c_uint32,
    c_uint64,
    c_void_p,
)
from functools import cache
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.messages import tr

__all__ = ["Aravis", "AravisError", "DEVICE_ERRORS", "FillPattern", "aravis"]

FillPattern = ctypes.CFUNCTYPE(None, c_void_p, c_void_p, c_uint32, c_uint32, c_uint32)
"""Fills a buffer of the fake camera: buffer, data, exposure in us, gain, pixel format."""

DEVICE_ERRORS: Final = "arv-device-error-quark"
"""Domain of the errors of a camera; the numbers are those of ``ArvDeviceError``."""

_NAMES: Final[Mapping[str, Sequence[str]]] = {
    "linux": ("libaravis-0.8.so.0",),
    "darwin": ("libaravis-0.8.0.dylib",),
    # Windows looks a function up in one library only, so those of GLib are named too.
    "win32": (
        *("libaravis-0.8-0.dll", "libgobject-2.0-0.dll", "libgio-2.0-0.dll"),
        "libglib-2.0-0.dll",
    ),
}


class _GError(ctypes.Structure):
    _fields_ = [("domain", c_uint32), ("code", c_int), ("message", c_char_p)]


class _GValue(ctypes.Structure):
    _fields_ = [("type", c_size_t), ("data", c_uint64 * 2)]


_Error = POINTER(POINTER(_GError))
_TYPE_INT: Final = 6 << 2
_TYPE_DOUBLE: Final = 15 << 2
"""GLib's numbers of its basic types, which never change (gtype.h)."""

_FUNCTIONS: Final[Mapping[str, tuple[Any, ...]]] = {
    # The result, then the arguments; _Error last where the function can fail.
    "arv_buffer_get_data": (c_void_p, c_void_p, c_void_p),
    "arv_buffer_get_frame_id": (c_uint64, c_void_p),
    "arv_buffer_get_image_data": (c_void_p, c_void_p, POINTER(c_size_t)),
    "arv_buffer_get_image_height": (c_int, c_void_p),
    "arv_buffer_get_image_padding": (None, c_void_p, POINTER(c_int), POINTER(c_int)),
    "arv_buffer_get_image_pixel_format": (c_uint32, c_void_p),
    "arv_buffer_get_image_region": (None, c_void_p, *[POINTER(c_int)] * 4),
    "arv_buffer_get_image_width": (c_int, c_void_p),
    "arv_buffer_get_payload_type": (c_int, c_void_p),
    "arv_buffer_get_status": (c_int, c_void_p),
    "arv_buffer_get_system_timestamp": (c_uint64, c_void_p),
    "arv_buffer_new_allocate": (c_void_p, c_size_t),
    "arv_camera_create_stream": (c_void_p, c_void_p, c_void_p, c_void_p, _Error),
    "arv_camera_dup_available_enumerations_as_strings": (
        *(c_void_p, c_void_p, c_char_p, POINTER(c_uint), _Error),
    ),
    "arv_camera_execute_command": (None, c_void_p, c_char_p, _Error),
    "arv_camera_get_device_serial_number": (c_char_p, c_void_p, _Error),
    "arv_camera_get_exposure_time": (c_double, c_void_p, _Error),
    "arv_camera_get_exposure_time_bounds": (
        *(None, c_void_p, POINTER(c_double), POINTER(c_double), _Error),
    ),
    "arv_camera_get_model_name": (c_char_p, c_void_p, _Error),
    "arv_camera_get_payload": (c_uint, c_void_p, _Error),
    "arv_camera_get_string": (c_char_p, c_void_p, c_char_p, _Error),
    "arv_camera_get_vendor_name": (c_char_p, c_void_p, _Error),
    "arv_camera_is_exposure_time_available": (c_int, c_void_p, _Error),
    "arv_camera_is_feature_available": (c_int, c_void_p, c_char_p, _Error),
    "arv_camera_new_with_device": (c_void_p, c_void_p, _Error),
    "arv_camera_set_exposure_time": (None, c_void_p, c_double, _Error),
    "arv_camera_set_string": (None, c_void_p, c_char_p, c_char_p, _Error),
    "arv_fake_camera_set_fill_pattern": (None, c_void_p, FillPattern, c_void_p),
    "arv_fake_camera_set_trigger_frequency": (None, c_void_p, c_double),
    "arv_fake_camera_get_genicam_xml": (c_char_p, c_void_p, c_void_p),
    "arv_fake_camera_get_payload": (c_size_t, c_void_p),
    "arv_fake_camera_new": (c_void_p, c_char_p),
    "arv_fake_camera_read_register": (c_int, c_void_p, c_uint32, POINTER(c_uint32)),
    "arv_fake_camera_write_register": (c_int, c_void_p, c_uint32, c_uint32),
    "arv_gv_device_is_controller": (c_int, c_void_p),
    "arv_gv_device_new": (c_void_p, c_void_p, c_void_p, _Error),
    "arv_gv_device_set_stream_options": (None, c_void_p, c_int),
    "arv_gv_fake_camera_get_fake_camera": (c_void_p, c_void_p),
    "arv_gv_fake_camera_is_running": (c_int, c_void_p),
    "arv_gv_fake_camera_new_full": (c_void_p, c_char_p, c_char_p, c_char_p),
    "arv_gv_interface_get_instance": (c_void_p,),
    "arv_interface_get_device_address": (c_char_p, c_void_p, c_uint),
    "arv_interface_get_device_id": (c_char_p, c_void_p, c_uint),
    "arv_interface_get_device_physical_id": (c_char_p, c_void_p, c_uint),
    "arv_interface_get_device_serial_nbr": (c_char_p, c_void_p, c_uint),
    "arv_interface_get_n_devices": (c_uint, c_void_p),
    "arv_interface_update_device_list": (None, c_void_p),
    "arv_stream_push_buffer": (None, c_void_p, c_void_p),
    "arv_stream_timeout_pop_buffer": (c_void_p, c_void_p, c_uint64),
    "arv_stream_try_pop_buffer": (c_void_p, c_void_p),
    "g_error_free": (None, POINTER(_GError)),
    "g_free": (None, c_void_p),
    "g_inet_address_new_from_string": (c_void_p, c_char_p),
    "g_object_set_property": (None, c_void_p, c_char_p, POINTER(_GValue)),
    "g_object_unref": (None, c_void_p),
    "g_quark_to_string": (c_char_p, c_uint32),
    "g_value_init": (c_void_p, POINTER(_GValue), c_size_t),
    "g_value_set_double": (None, POINTER(_GValue), c_double),
    "g_value_set_int": (None, POINTER(_GValue), c_int),
}


class AravisError(Exception):
    """What the library says when it cannot do something.

    Attributes:
        domain: Whose error number it is; :data:`DEVICE_ERRORS` for the camera's.
        code: The number.
    """

    def __init__(self, domain: str, code: int, message: str) -> None:
        super().__init__(message)
        self.domain = domain
        self.code = code


class Aravis:
    """The loaded library.

    Args:
        libraries: Where its functions are looked up, in this order.

    Raises:
        AttributeError: One of them is not there.
    """

    def __init__(self, libraries: Sequence[ctypes.CDLL]) -> None:
        self._functions = dict[str, Any]()
        for name, (result, *arguments) in _FUNCTIONS.items():
            function = _found(libraries, name)
            function.restype, function.argtypes = result, arguments
            self._functions[name] = function

    def call(self, name: str, *arguments: object) -> Any:  # noqa: ANN401 - each has its own
        """Call a function that cannot fail, and return what it returns."""
        return self._functions[name](*arguments)

    def checked(self, name: str, *arguments: object) -> Any:  # noqa: ANN401 - each has its own
        """Call a function whose last argument is the error, which is left out here.

        Raises:
            AravisError: It failed.
        """
        error = POINTER(_GError)()
        result = self._functions[name](*arguments, ctypes.byref(error))
        if error:
            try:
                told = error.contents
                domain = self.call("g_quark_to_string", told.domain) or b""
                message = (told.message or b"").decode("utf-8", "replace")
                raise AravisError(domain.decode("ascii", "replace"), told.code, message)
            finally:
                self.call("g_error_free", error)
        return result

    def set_property(self, instance: int, name: str, value: float) -> None:
        """Set a property of an object to a whole number, or to any where ``value`` is a float."""
        held = _GValue()
        whole = isinstance(value, int)
        self.call("g_value_init", ctypes.byref(held), _TYPE_INT if whole else _TYPE_DOUBLE)
        setter = "g_value_set_int" if whole else "g_value_set_double"
        self.call(setter, ctypes.byref(held), value)
        self.call("g_object_set_property", instance, name.encode("ascii"), ctypes.byref(held))

    def let_go(self, instance: int | None) -> None:
        """Give back one reference to an object, which ends it where it was the last."""
        if instance:
            self.call("g_object_unref", instance)


@cache
def aravis() -> Aravis:
    """Return the library, loaded once in a process.

    Raises:
        ConfigError: It is not installed, or too old.
    """
    names = _NAMES.get(sys.platform, _NAMES["linux"])
    try:
        return Aravis([ctypes.CDLL(name) for name in names])
    except OSError as error:
        raise ConfigError(
            tr("A GigE camera needs the library Aravis 0.8, which is not installed here."),
            remedy=tr(
                "On Debian and Ubuntu: apt-get install libaravis-0.8-0. Elsewhere: "
                "docs/install.md. Or use the camera's HTTP address."
            ),
        ) from error
    except AttributeError as error:
        raise ConfigError(
            tr("The library Aravis that is installed here is too old: {cause}.", cause=error),
            remedy=tr("Install Aravis 0.8.25 or later of the series 0.8."),
        ) from error


def _found(libraries: Sequence[ctypes.CDLL], name: str) -> Any:  # noqa: ANN401 - a function
    for library in libraries[:-1]:
        if hasattr(library, name):
            return getattr(library, name)
    return getattr(libraries[-1], name)
