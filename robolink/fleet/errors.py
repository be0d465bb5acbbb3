"""Errors about plans; both end a command with exit code 2."""

from robolink.errors import ConfigError


class PlanError(ConfigError):
    """A plan is unknown, or it, its recipe or a permit is not as it has to be."""


class PlantError(ConfigError):
    """The plant's database cannot be opened, read or added to."""
