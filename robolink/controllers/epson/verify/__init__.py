"""Finding out, without motion and without a write, what a controller really does."""

from robolink.controllers.epson.verify.run import verify_epson as verify_epson
from robolink.controllers.epson.verify.verification import PROFILE_SCHEMA as PROFILE_SCHEMA
from robolink.controllers.epson.verify.verification import Fact as Fact
from robolink.controllers.epson.verify.verification import Verification as Verification
from robolink.controllers.epson.verify.verification import redacted as redacted
