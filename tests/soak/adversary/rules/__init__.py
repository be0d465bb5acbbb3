"""The rules that hold whatever happens. Each has a name, and reads past the driver.

Where two rules meet, docs/reference/rules.md says what is allowed: after a stop the old tool may be
selected, and each tool of an open change restored once (5); what a lost answer, a lost disk or a
hand at the pendant leaves open counts as reported if an open marker, or the error, says so.
"""

from tests.soak.adversary.rules.grounds import NAMES as NAMES
from tests.soak.adversary.rules.rulebook import Rulebook as Rulebook
