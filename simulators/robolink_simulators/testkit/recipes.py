"""The recipe of a simulated cell: a touch at its pin, by whoever stands there."""

from pathlib import Path
from typing import Final

_RECIPE: Final = """\
schema = "robolink/recipe/1"
name = "Needle on the simulated pin"
basis = "absolute"
z = "kept"

[source]
kind = "two-pose"

[station]
id = "PIN"

[[tools]]
number = 1

[speeds]
percent = 30
"""


def written_recipe(folder: Path) -> Path:
    """Write the recipe of a simulated cell into a folder and return its path."""
    path = folder / "recipe.toml"
    path.write_text(_RECIPE, encoding="utf-8")
    return path


MAP: Final = """\
schema = "robolink/plc-map/1"
name = "simulated dispenser"

[numbers]
table = "holding"
type = "REAL"
word_order = "low_first"

[[tools]]
number = 1
name = "needle A"
x = { address = 100 }
y = { address = 102 }
z = { address = 104 }
u = { address = 106 }

[[tools]]
number = 2
name = "needle B"
x = { address = 110 }
y = { address = 112 }
z = { address = 114 }
u = { address = 116 }

[commit]
kind = "commit_bit"
trigger = { table = "coil", address = 2000 }
done = { table = "discrete", address = 0 }
timeout_s = 2.0

[probe]
table = "input"
address = 20
value = 12.3456

[permit]
table = "discrete"
address = 3

[selected]
table = "input"
address = 11

[device_id]
table = "input"
address = 50
"""
"""A PLC with two tools, taken over on a commit bit, that tells who it is."""


def written_map(folder: Path) -> Path:
    """Write the map of a simulated PLC into a folder and return its path."""
    path = folder / "machine.toml"
    path.write_text(MAP, encoding="utf-8")
    return path
