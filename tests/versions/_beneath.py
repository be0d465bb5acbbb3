"""Why no lower version of a dependency is declared: the release below fails, or a reason."""

from collections.abc import Mapping
from typing import Final

FAILING: Final[Mapping[str, tuple[str, str]]] = {
    "annotated-types": ("0.5.0", "tests/unit/test_recipe_files.py"),
    "click": ("8.4.2", "tests/cli/test_command_names.py"),
    "pydantic": ("2.8.2", "tests/unit/test_recipe_files.py"),
}
"""The release below the lowest, and tests that do not pass with it."""

_OLDER: Final = "the releases beneath are older than Python 3.11"

_RECENT: Final = "of what meets a network, only releases of the last two years are tried"

REASONS: Final[Mapping[str, str]] = {
    "asyncua": "its codec is no promised interface: each minor version is tried (decision 0012)",
    "canopen": _OLDER,
    "cryptography": _RECENT,
    "dbos": "its gaps were looked at in this release (docs/decisions/0072)",
    "jinja2": "the releases beneath have a published way out of the sandbox (CVE-2025-27516)",
    "keyring": _OLDER,
    "lark": _OLDER,
    "markupsafe": _OLDER,
    "msgpack": _OLDER,
    "numpy": _OLDER,
    "opencv-python-headless": _RECENT,
    "paho-mqtt": _RECENT,
    "pillow": _RECENT,
    "platformdirs": _OLDER,
    "prometheus-client": _RECENT,
    "prompt_toolkit": _OLDER,
    "psycopg": _OLDER,
    "pymodbus": "the releases beneath lack the server that judges our frames in the tests",
    "pyserial": "it is the last release; the one before is of 2017",
    "python-can": "4.2 imports pkg_resources, which an environment of today need not have",
    "rich": _OLDER,
    "sqlalchemy": "dbos asks for this release or a later one",
    "starlette": "1.0 is the first release whose interface is promised to stay",
    "uvicorn": "the releases beneath take no context of TLS that was made before",
    "websockets": _RECENT,
}
"""Why a lower one was not tried although the tests might pass with it.

The authors of a release older than Python 3.11 (24 October 2022) never tried it on any Python that
robolink runs on.
"""
