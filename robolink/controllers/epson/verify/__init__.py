"""Finding out, without motion and without a write, what a controller really does."""

from robolink.controllers.epson.verify.line_probe import AtTheLine as AtTheLine
from robolink.controllers.epson.verify.line_probe import LineProbe as LineProbe
from robolink.controllers.epson.verify.line_probe import probe_line as probe_line
from robolink.controllers.epson.verify.line_probe import require_line as require_line
from robolink.controllers.epson.verify.run import verify_epson as verify_epson
from robolink.controllers.epson.verify.verification import PROFILE_SCHEMA as PROFILE_SCHEMA
from robolink.controllers.epson.verify.verification import Fact as Fact
from robolink.controllers.epson.verify.verification import Verification as Verification
from robolink.controllers.epson.verify.verification import redacted as redacted
