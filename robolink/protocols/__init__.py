"""Sans-IO codecs: bytes to events and back, for both ends of the line. No clock, no sockets."""

from robolink.protocols._role import NEED_DATA, Role

__all__ = [
    "NEED_DATA",
    "Role",
]
