"""Separates requests that only read from those that change something."""

import re
from collections.abc import Iterable

_READ = re.compile(r'\$(Get\w+(,.*)?|Login,.*|Logout|Execute,"(Print .*|TLSet|Where|Base)")')


def changes(requests: Iterable[str]) -> list[str]:
    """Return those of ``requests``, as the simulator's log has them, that do more than read."""
    return [request for request in requests if not _READ.fullmatch(request)]
