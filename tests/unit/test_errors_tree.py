"""The tree of errors that is drawn at the top of the module is the one that is there."""

import re

from robolink import errors


def drawn():
    """Return each drawn class with its parent."""
    path: list[str] = []
    found: dict[str, str | None] = {}
    for line in str(errors.__doc__).splitlines():
        match = re.match(r"    ((?:│   |    )*)(?:[├└]── )?([A-Z]\w*Error(?: · \w+Error)*)\b", line)
        if match is None:
            continue
        names = match[2].split(" · ")
        depth = len(match[1]) // 4 + ("──" in line.partition(names[0])[0])
        for name in names:
            found[name] = path[depth - 1] if depth else None
        path = [*path[:depth], names[-1]]
    return found


def test_every_class_is_drawn_under_its_parent():
    there: dict[str, str | None] = {
        name: kind.__bases__[0].__name__
        for name, kind in vars(errors).items()
        if isinstance(kind, type) and issubclass(kind, errors.RobolinkError)
    }
    there["RobolinkError"] = None
    assert drawn() == there
