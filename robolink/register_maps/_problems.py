"""What is wrong in a map, said by the path of the key: ``tools#2.x.address``.

Tables of a list are counted from 1, as people do, hence the sign.
"""

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.toml_files import Problem

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


def refusal(path: Path, problems: Sequence[Problem]) -> ConfigError:
    """Return the error that tells all problems of one map at once."""
    lines = "\n".join(f"    {problem}" for problem in problems)
    return ConfigError(
        tr(
            "The PLC map {path} is wrong in {count} places:\n{lines}",
            path=path,
            count=len(problems),
            lines=lines,
        )
        if len(problems) > 1
        else tr("The PLC map {path} is wrong:\n{lines}", path=path, lines=lines),
        remedy=tr("Correct it; docs/plc-maps.md explains every key. Nothing was sent."),
    )


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
    limits = detail.get("ctx", {})
    match detail["type"]:
        case "extra_forbidden":
            return _unknown(str(detail["loc"][-1]))
        case "missing":
            return tr("is missing")
        case "literal_error" | "union_tag_invalid" | "union_tag_not_found":
            known = limits.get("expected") or limits.get("expected_tags") or ""
            return tr(
                "must be one of {known}",
                known=known or "'commit_bit', 'level', 'none' (kind)",
            )
        case "float_type" | "int_type":
            return tr("must be a number")
        case "string_type":
            return tr("must be a text in quotes")
        case "model_type" | "dict_type" | "model_attributes_type":
            return tr("must be a table")
        case "list_type":
            return tr("must be a list of tables")
        case "greater_than":
            return tr("must be more than {limit:g}", limit=limits["gt"])
        case "greater_than_equal":
            return tr("must be at least {limit:g}", limit=limits["ge"])
        case "less_than_equal":
            return tr("must be at most {limit:g}", limit=limits["le"])
        case "finite_number":
            return tr("must be a finite number")
        case "too_short":
            return tr("must not be empty")
        case _:
            return str(detail["msg"])


def _unknown(key: str) -> str:
    from robolink.register_maps._tables import KEYS

    close = get_close_matches(key, sorted(KEYS), n=1)
    if close:
        return tr("is not known here; is {name} meant?", name=close[0])
    return tr("is not known here; docs/plc-maps.md lists the keys")
