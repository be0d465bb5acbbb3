"""A ``stop`` on the command line, parsed by hand: click takes longer to load than a stop takes."""

import os
from collections.abc import Sequence
from typing import Final, NamedTuple

VALUES: Final = {
    "-c": "named",
    "--controller": "named",
    "--password-file": "password_file",
    "--timeout": "timeout_s",
    "--remote-timeout": "",
    "--wait": "",
    "--operator": "operator",
    "--record": "record",
    "--log-file": "log_file",
    "--log-level": "log_level",
    "--lang": "",
}
"""Options with a value that are allowed with ``stop``, and the field for each value. A stop needs
no remote time-out and waits for nobody, and the language is determined elsewhere. A test compares
this table with click's.
"""

FLAGS: Final = {"--json": "json"}


class StopRequest(NamedTuple):
    """The arguments of a stop.

    Attributes:
        named: A cell's name or a URL; empty for none.
        json: Whether the result goes to stdout as one JSON document.
        password_file: File whose first line is the password.
        timeout_s: Longest wait for one answer.
        operator: Badge or name of the person.
        record: File to which the dialogue is appended afterwards.
        log_file: File to which it is logged afterwards.
        log_level: How much; empty for the usual.
    """

    named: str = ""
    json: bool = False
    password_file: str = ""
    timeout_s: float = 3.0
    operator: str = ""
    record: str = ""
    log_file: str = ""
    log_level: str = ""


def read_stop(arguments: Sequence[str]) -> StopRequest | None:
    """Return the request in the arguments; ``None`` if click has to explain them."""
    if "_ROBOLINK_COMPLETE" in os.environ:
        return None
    found: dict[str, str] = {}
    commands = []
    rest = iter(arguments)
    for word in rest:
        option, given, value = word.partition("=") if word.startswith("--") else (word, "", "")
        if word in FLAGS:
            found[FLAGS[word]] = word
        elif option in VALUES:
            taken = value if given else next(rest, None)
            if taken is None:
                return None
            found[VALUES[option]] = taken
        else:
            commands.append(word)
    if commands != ["stop"]:
        return None
    timeout_s = _seconds(found.get("timeout_s", "3"))
    if timeout_s is None:
        return None
    return StopRequest(
        named=found.get("named") or os.environ.get("ROBOLINK_CONTROLLER", ""),
        json="json" in found,
        password_file=found.get("password_file", ""),
        timeout_s=timeout_s,
        operator=found.get("operator") or os.environ.get("ROBOLINK_OPERATOR", ""),
        record=found.get("record", ""),
        log_file=found.get("log_file", ""),
        log_level=found.get("log_level", ""),
    )


def _seconds(text: str) -> float | None:
    try:
        seconds = float(text)
    except ValueError:
        return None
    return seconds if 0 < seconds < float("inf") else None
