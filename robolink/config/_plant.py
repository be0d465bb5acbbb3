"""Which database of the plant has its plans, and gets copies of this computer's journals."""

import os
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Final

from robolink.config._files import config_files, read_document
from robolink.errors import ConfigError

PLANT_VARIABLE: Final = "ROBOLINK_PLANT"


@dataclass(frozen=True, slots=True)
class NamedPlant:
    """The plant's database, and what names it.

    Attributes:
        location: The database: a URL, or the path of a file.
        origin: The variable or the file that names it.
    """

    location: str = field(repr=False)
    origin: str

    @property
    def takes_copies(self) -> bool:
        """Whether journals are copied there: a file of this computer is no witness of them."""
        return "://" in self.location and not self.location.startswith("sqlite:")


def named_plant() -> NamedPlant | None:
    """Return the plant's database, ``None`` where nothing names one.

    ROBOLINK_PLANT names it, else ``plant`` in the nearest cell file that has the key. An empty
    variable names none. A file that cannot be read is passed over: a command that needs it says so.
    """
    said = os.environ.get(PLANT_VARIABLE)
    if said is not None:
        return NamedPlant(said, PLANT_VARIABLE) if said else None
    for file in config_files():
        if file.present:
            with suppress(ConfigError):
                url = read_document(file.path).get("plant")
                if isinstance(url, str) and url:
                    return NamedPlant(url, str(file.path))
    return None
