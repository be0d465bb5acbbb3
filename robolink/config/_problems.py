"""What is wrong in a cell file, said by the path of the key: ``cells.line3.timeout_s``."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from robolink.files.key_problems import is_not_known, sentence
from robolink.files.toml import Problem
from robolink.messages import tr

if TYPE_CHECKING:
    from pydantic import ValidationError

_BARE_KEY = re.compile("[A-Za-z0-9_-]+")
_KIND = 4
"""Where in a path the kind of a station stands: cells, NAME, stations, ID, kind."""

_SECRET = re.compile("pass|pwd|secret|token|credential|^pin$", re.IGNORECASE)


def dotted(keys: Iterable[object]) -> str:
    """Return the path of a key as TOML writes it."""
    texts = (str(key) for key in keys)
    return ".".join(
        text if _BARE_KEY.fullmatch(text) else json.dumps(text, ensure_ascii=False)
        for text in texts
    )


def problems_of(
    error: "ValidationError",
    known: Mapping[int, Sequence[str]],
    kinds: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> list[Problem]:
    """Return everything that pydantic objects to.

    Args:
        error: What it raised.
        known: The keys that are known at each depth, for a better guess at what was meant.
        kinds: The same for stations, by their kind.
    """
    details = error.errors(include_url=False, include_input=False)
    problems = []
    for detail in details:
        path, names = list(detail["loc"]), known.get(len(detail["loc"]), ())
        # Behind the name of a station pydantic puts its kind, which stands in no file.
        if len(path) > _KIND and path[2] == "stations":
            names = kinds.get(str(path.pop(_KIND)), ())
        counted = [part + 1 if isinstance(part, int) else part for part in path]
        problems.append(Problem(dotted(counted), _sentence(detail, names, kinds)))
    return problems


def _sentence(
    detail: Any,  # noqa: ANN401 - pydantic's own form
    known: Sequence[str],
    kinds: Iterable[str],
) -> str:
    match detail["type"]:
        case "extra_forbidden":
            return _unknown(str(detail["loc"][-1]), known)
        case "union_tag_invalid" | "union_tag_not_found":
            return tr("needs a kind: {kinds}", kinds=", ".join(kinds))
        case "string_pattern_mismatch":
            return tr("must be the name of a variable that begins with ROBOLINK_PASSWORD")
    return sentence(detail)


def _unknown(key: str, known: Sequence[str]) -> str:
    if _SECRET.search(key):
        return tr(
            "looks like a password, and a cell file must not hold one; name a "
            "password_file that only you can read, or a password_env"
        )
    return is_not_known(key, known)
