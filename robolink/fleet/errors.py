"""Errors about plans; each ends a command with exit code 2."""

from robolink.errors import ConfigError


class PlanError(ConfigError):
    """A plan is unknown, or it, its recipe or a permit is not as it has to be."""


class PlantError(ConfigError):
    """The plant's database cannot be opened, read or added to."""


class PlantVersionError(PlantError):
    """The tables of the plant's database are those of another version of robolink."""
