"""Finds out, without motion and without a write, what a controller really does."""

from robolink.controllers.epson.verify.line_probe import (
    AtTheLine,
    LineProbe,
    probe_line,
    require_line,
)
from robolink.controllers.epson.verify.run import verify_epson
from robolink.controllers.epson.verify.verification import (
    PROFILE_SCHEMA,
    Fact,
    Verification,
    redacted,
)

__all__ = [
    "AtTheLine",
    "Fact",
    "LineProbe",
    "PROFILE_SCHEMA",
    "Verification",
    "probe_line",
    "redacted",
    "require_line",
    "verify_epson",
]
