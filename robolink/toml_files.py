"""Reading the TOML files that people write, and naming what is wrong in them."""

import tomllib
from dataclasses import dataclass

from robolink.messages import tr


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong in a file.

    Attributes:
        where: Path of the key inside the file; empty for the file as a whole.
        what: What is wrong with it. Never the value: it might be a password.
    """

    where: str
    what: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}" if self.where else self.what


class NotTomlError(ValueError):
    """The bytes are no TOML; its text says why. Whoever reads the file says which file."""


def parse_toml(content: bytes) -> dict[str, object]:
    """Return what a TOML file says.

    Raises:
        NotTomlError: It is no TOML.
    """
    try:
        # Editors on Windows put a byte order mark in front, which TOML does not know.
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeError as error:
        raise NotTomlError(tr("it is not UTF-8 text")) from error
    except RecursionError as error:
        raise NotTomlError(tr("it is nested too deeply")) from error
    except ValueError as error:  # TOML, or a number with thousands of digits
        raise NotTomlError(str(error)) from error
