"""The rules that hold whatever happens. Each has a name, and looks past the driver.

What is allowed where two rules meet is that of docs/reference/rules.md: after a stop the old tool
may be selected, and each tool of an open change written back once (5); what a lost answer, a lost
disk or a hand at the pendant leaves open counts as told when an open marker, or the error, says so.
"""

from tests.soak.adversary.rules.grounds import NAMES as NAMES
from tests.soak.adversary.rules.rulebook import Rulebook as Rulebook
