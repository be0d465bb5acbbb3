"""What is wrong in a map, said by the path of the key: ``tools#2.x.address``.

Tables of a list are counted from 1, as people do, hence the sign.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from robolink.files.key_problems import is_not_known, sentence
from robolink.files.toml import Problem
from robolink.messages import tr

if TYPE_CHECKING:
    from pydantic import ValidationError

_COMMIT_DEPTH: Final = 2
"""How deep pydantic's location goes before the kind of commit stands in it."""


def problems_of(error: "ValidationError") -> list[Problem]:
    """Return everything that pydantic objects to."""
    return [
        Problem(_path(detail["loc"]), _sentence(detail))
        for detail in error.errors(include_url=False, include_input=False)
    ]


def _path(location: Sequence[int | str]) -> str:
    steps = list(location)
    if len(steps) > _COMMIT_DEPTH and steps[0] == "commit":
        del steps[1]  # the kind of commit, which pydantic puts in and no file has
    path = ""
    for step in steps:
        joint = "." if path else ""
        path += f"#{step + 1}" if isinstance(step, int) else f"{joint}{step}"
    return path


def _sentence(detail: Any) -> str:  # noqa: ANN401 - pydantic's own form
    match detail["type"]:
        case "extra_forbidden":
            from robolink.register_maps._tables import KEYS

            return is_not_known(str(detail["loc"][-1]), sorted(KEYS))
        case "union_tag_invalid" | "union_tag_not_found":
            return tr("needs a kind: {kinds}", kinds="commit_bit, level, none")
        case "list_type":
            return tr("must be a list of tables")
        case "too_short":
            return tr("must not be empty")
    return sentence(detail)
