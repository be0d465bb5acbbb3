"""Acts on a journal that several tests use."""

from robolink.journal import Journal
from robolink.model import Marker, MarkerKind


def marker(operation: str = "a", kind: MarkerKind = MarkerKind.SET) -> Marker:
    """Return a marker of a tool write or another act on tool 3."""
    return Marker(operation, kind, "TLSet 3, XY(...)", "2025-01-01T00:00:00+00:00", {"tool": 3})


def run(journal: Journal, statement: str) -> None:
    """Change the database without going through the journal."""
    with journal._store.write(leaves=0) as tables:  # whatever of its tables is left
        tables.connection.run(statement)
