"""Finding out, without motion and without a write, what a controller really does."""

from robolink.controllers.epson.verify._run import verify_epson as verify_epson
from robolink.controllers.epson.verify._transcript import redacted as redacted
from robolink.controllers.epson.verify._verification import PROFILE_SCHEMA as PROFILE_SCHEMA
from robolink.controllers.epson.verify._verification import Fact as Fact
from robolink.controllers.epson.verify._verification import Verification as Verification
