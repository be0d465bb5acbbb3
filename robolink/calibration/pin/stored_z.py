"""What is known of the Z that a one-touch change is added to.

One touch tells by how much the new tip differs from the old one. How long it is, is known only as
well as the old Z was: where nobody ever measured that, the result is a change of Z and says
nothing of Z itself (docs/reference/evidence.md 12).
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class StoredZ:
    """The stored Z of a tool, with what is on record of it.

    Attributes:
        value_mm: The stored value.
        half95_mm: Half the 95 % interval of the measurement that it goes back to; ``None`` where
            none is on record.
        entry: Number of that entry in the journal, ``None`` where there is none.
    """

    value_mm: float
    half95_mm: float | None = None
    entry: int | None = None

    @property
    def on_record(self) -> bool:
        """Whether an earlier measurement says how well it is known."""
        return self.half95_mm is not None

    def as_json(self) -> dict[str, object]:
        """Return it as plain JSON."""
        return {"value_mm": self.value_mm, "half95_mm": self.half95_mm, "entry": self.entry}
