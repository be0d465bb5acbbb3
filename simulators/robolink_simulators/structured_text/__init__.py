"""An interpreter for the subset of Structured Text that several compilers read alike.

It executes what ``robolink expert plc export`` writes (docs/reference/structured_text.md 4). It
refuses, with file, line and column, what is outside of the subset, and what compilers are known to
do differently.
"""

from robolink_simulators.structured_text.parse import StructuredTextError, TextDialect
from robolink_simulators.structured_text.program import SourceText, StructuredProgram

__all__ = [
    "SourceText",
    "StructuredProgram",
    "StructuredTextError",
    "TextDialect",
]
