"""The figures by which touches are told (docs/reference/evidence.md 1)."""

from typing import Final

NEAREST_MM: Final = 0.8
FARTHEST_MM: Final = 1.2
"""How far beside the pin the tip stops: well above what a person misses it by."""

LEVELS_MM: Final = (0.0, 0.6, 1.2, 1.8)
"""How much above the clearance it stops: one and the same way down would not end at one height."""

HIGHEST_MM: Final = max(LEVELS_MM)

LEAST_JOG_MM: Final = 0.02
PRINT_STEPS: Final = 3
"""A robot at rest prints positions that differ by as much."""

LEAST_HEIGHT_LIMIT_MM: Final = 0.10
PERSON_SIGMA_Z_MM: Final = 0.05
PROBE_SIGMA_Z_MM: Final = 0.01
"""Standard deviation of a touch in height, of a person and of a contact input."""

MOST_LEFT: Final = 0.5
"""Share of the standoffs that may be left, with the uncertainty of the share on top."""

MOST_RESIDUAL_MM: Final = 0.15
