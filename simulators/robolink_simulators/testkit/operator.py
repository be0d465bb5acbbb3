"""A person at a simulated cell who follows a script, at the right time."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.control.acts import act_named, perform
from robolink_simulators.control.cell import ControlledCell


@dataclass(slots=True)
class _Cue:
    match: str
    left: int
    act: str
    given: dict[str, object]


@dataclass(slots=True)
class ScriptedOperator:
    """Does acts of the control API (docs/control-api.md), at once or on a cue of the wire.

    A test whose script was not played to its end has tried something else than it says: the
    fixtures let it fail, unless it drops the script by :meth:`forget`.

    Args:
        cell: Where.

    Attributes:
        done: What was done on a cue, in order: the request that was the cue, and the act.
        failed: What the person could not do on a cue, and why.
    """

    cell: ControlledCell
    done: list[tuple[str, str]] = field(default_factory=list)
    failed: list[tuple[str, str]] = field(default_factory=list)
    _cues: list[_Cue] = field(default_factory=list)

    def do(self, act: str, **given: object) -> dict[str, object]:
        """Carry out an act now, and return its result.

        Raises:
            ConfigError: There is no such act, or a value is missing, wrong or unknown.
        """
        return perform(self.cell, act, given)

    def when(self, match: str, act: str, *, skip: int = 0, **given: object) -> None:
        """Carry out an act just before a request that contains a text, once.

        Args:
            match: Any part of the request, as the wire log shows it.
            act: Of the control API.
            skip: How many such requests are let pass first.
            given: What the act takes.

        Raises:
            ConfigError: There is no such act, or a value is missing, wrong or unknown.
        """
        if type(skip) is not int or skip < 0:  # the cue would never fire
            raise ConfigError(
                tr("{name} of a simulated cell cannot be {value!r}.", name="skip", value=skip),
                remedy=tr("Give it as {example}.", example="skip=1"),
            )
        act_named(self.cell, act).checked(given)
        self._cues.append(_Cue(match, skip, act, dict(given)))
        self.cell.simulator.on_request = self._heard

    @property
    def waiting(self) -> int:
        """The number of cues that have not come yet."""
        return len(self._cues)

    def unplayed(self) -> list[str]:
        """Return what was not done of the script, each as a sentence."""
        late = [
            f"No request came that contains {cue.match!r}, at which {cue.act} was to be done."
            for cue in self._cues
        ]
        return late + [f"{act} could not be done: {why}" for act, why in self.failed]

    def forget(self) -> None:
        """Drop the script, its results, and its failures."""
        self._cues.clear()
        self.done.clear()
        self.failed.clear()

    def _heard(self, _number: int, request: str) -> None:
        for cue in tuple(self._cues):
            if cue.match not in request:
                continue
            if cue.left:
                cue.left -= 1
                continue
            self._cues.remove(cue)
            try:
                perform(self.cell, cue.act, cue.given)
            except Exception as error:
                self.failed.append((cue.act, str(error)))
            else:
                self.done.append((request, cue.act))


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
"""Register map of a PLC with an identity and two tools, which a commit bit takes over."""


def written_map(folder: Path) -> Path:
    """Write the map of a simulated PLC into a folder and return its path."""
    path = folder / "machine.toml"
    path.write_text(MAP, encoding="utf-8")
    return path


SYMBOL_MAP: Final = """\
schema = "robolink/plc-map/1"
name = "two needles by symbol"

[numbers]
root = "ns=4;s=|var|PLC.Application.GVL_Tools."
type = "LREAL"

[[tools]]
number = 1
node = "aNeedleA"
length = 6
x = { element = 0 }
y = { element = 1 }
z = { element = 2 }

[[tools]]
number = 2
node = "aNeedleB"
length = 6
x = { element = 0 }
y = { element = 1 }
z = { element = 2 }

[commit]
kind = "commit_bit"
trigger = { node = "xTakeOver" }
done = { node = "xDone" }

[cycle_counter]
node = "udiCycle"

[selected]
node = "uiSelected"

[device_id]
node = "udiDeviceId"
"""
"""Map of a PLC with the same two tools as arrays, by the names of its variables."""


def written_symbol_map(folder: Path) -> Path:
    """Write a map of symbols of a simulated PLC into a folder and return its path."""
    path = folder / "symbols.toml"
    path.write_text(SYMBOL_MAP, encoding="utf-8")
    return path
