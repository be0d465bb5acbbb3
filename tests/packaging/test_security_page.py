"""The limits that docs/security.md names are those that hold."""

import re
from pathlib import Path

from robolink_cli.access import password
from robolink_cli.commands.measure.solve import answer
from robolink_simulators.control import assist as port
from robolink_simulators.hosting import replay

from robolink.backup import _file as backup
from robolink.files import named, toml
from robolink.register_maps import _drafts as drafts

PAGE = Path(__file__).parents[2] / "docs" / "security.md"


def shown(size):
    return f"{size // 1_000_000} MB" if size >= 1_000_000 else f"{size // 1000} kB"


def test_every_limit_of_the_page_is_the_one_in_the_code():
    text = PAGE.read_text(encoding="utf-8").partition("## Limits of what is read")[2]
    rows = dict(re.findall(r"^\| ([^|]+?) \| ([^|]+?) \|$", text.partition("\n## ")[0], re.M))
    of_toml = f"{shown(toml.MOST_BYTES)}, {toml._MOST_PARTS} parts of a key"
    assert rows == {
        "what": "most",
        "cell file, recipe, PLC map": of_toml,
        "backup, register list": shown(backup._LONGEST),
        "poses, points, state of a simulator, profile": shown(named.MOST_BYTES),
        "a password file": shown(password._MOST_BYTES),
        "cases of `solve`": shown(answer._MOST_BYTES),
        "a recording that is replayed": shown(replay._MOST_BYTES),
        "a line at a simulator's assist port": (
            f"{port.LONGEST_LINE} bytes, {port.MOST_CLIENTS} clients"
        ),
    }
    assert drafts._MOST_BYTES == backup._LONGEST
