"""``python -m robolink_simulators.soak`` says where the adversary went: into the tests' tree."""

import sys
from typing import Final

_WHERE: Final = (
    "The adversary is no longer installed. In a source tree of robolink, run:"
    " python -m tests.soak.adversary"
)

if __name__ == "__main__":
    sys.exit(_WHERE)
