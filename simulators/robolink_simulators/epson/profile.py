"""Cell profiles: what ``verify-controller`` found out, loaded as simulator options."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.named_files import read_named

PROFILE_SCHEMA: Final = "robolink/epson-profile/1"


def read_profile(path: Path) -> Mapping[str, str]:
    """Return the options of a cell profile as text; what was not settled is absent.

    Names and values are checked where the options are made.

    Raises:
        ConfigError: The file cannot be read, or is no profile.
    """
    try:
        document = json.loads(read_named(path))
        if document["schema"] != PROFILE_SCHEMA:
            raise ValueError(document["schema"])
        return {str(name): str(value) for name, value in document["options"].items()}
    except (OSError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise ConfigError(
            tr("{path} is not a cell profile.", path=path),
            remedy=tr("Give a file that 'robolink verify-controller --profile' has written."),
        ) from error
