"""The recipes whose runs are disturbed."""

from pathlib import Path
from typing import Final

EXAMPLES: Final = Path(__file__).parents[2] / "examples" / "recipes"

TWO_NOZZLES: Final = """
schema = "robolink/recipe/1"
name = "Both nozzles of the placing head"
basis = "absolute"
z = "kept"

[source]
kind = "two-pose"
lift_mm = 5

[station]
id = "PIN-07"

[poses]
safe = { x_mm = 153, y_mm = 501, z_mm = -70, u_deg = 0 }

[[tools]]
number = 1
name = "left nozzle"
approach = { x_mm = 153, y_mm = 501, z_mm = -82, u_deg = 0 }
retreat = { x_mm = 153, y_mm = 501, z_mm = -76, u_deg = 0 }

[[tools]]
number = 2
name = "right nozzle"
approach = { x_mm = 153, y_mm = 501, z_mm = -82, u_deg = 0 }

[box]
sideways_mm = 60
down_mm = 60
up_mm = 60

[[prompts]]
at = "start"
text = "Lot of the new nozzles?"
answer = "lot"

[[prompts]]
at = "before_measure"
text = "Id of this nozzle?"
answer = "nozzle"

[[prompts]]
at = "before_write"
text = "Is the cell clear for the proof?"

[[prompts]]
at = "end"
text = "Anything to note?"
answer = "text"

[[outputs]]                    # vacuum off while the tips are at the pin
at = "start"
output = 8
on = false

[[outputs]]                    # the purge of the left nozzle
at = "before_measure"
output = 9
on = true
tool = 1

[[outputs]]
at = "after_measure"
output = 9
on = false
tool = 1

[[outputs]]
at = "before_write"
output = 10
on = true

[[outputs]]
at = "end"
output = 10
on = false

[[outputs]]
at = "end"
output = 8
on = true
"""
"""The two-nozzle example with two touches a tip, near the pin, and with more outputs to switch."""

ON_THE_PLC: Final = """
schema = "robolink/recipe/1"
name = "Nozzle of the PLC machine"
basis = "absolute"
z = "kept"

[source]
kind = "two-pose"
turn_deg = 60
lift_mm = 4
clearance_mm = 2

[station]
id = "PIN-11"

[[tools]]
number = 1

[speeds]
percent = 100
mm_s = 100
"""
"""One tool, measured from the machine's present position."""

TWO_ON_THE_PLC: Final = (
    ON_THE_PLC
    + """
[[tools]]
number = 2

[[prompts]]
at = "start"
text = "Lot of the new nozzles?"
answer = "lot"

[[prompts]]
at = "before_measure"
text = "Is this nozzle tight?"

[[outputs]]
at = "start"
output = 8
on = false

[[outputs]]
at = "before_write"
output = 9
on = true

[[outputs]]
at = "end"
output = 9
on = false

[[outputs]]
at = "end"
output = 8
on = true
"""
)
"""Two nozzles on one head, with prompts and outputs."""
