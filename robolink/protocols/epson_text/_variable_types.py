"""The types of Global Preserve variables (docs/reference/epson.md 1.2 note 4)."""

from enum import StrEnum


class VariableType(StrEnum):
    """The types that Remote Ethernet knows, as they are written on the wire."""

    BOOLEAN = "Boolean"
    BYTE = "Byte"
    DOUBLE = "Double"
    INTEGER = "Integer"
    LONG = "Long"
    REAL = "Real"
    STRING = "String"
