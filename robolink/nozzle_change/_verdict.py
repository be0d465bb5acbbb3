"""What a limit says about a proposal."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Verdict:
    """What one limit says about a proposal.

    Attributes:
        code: With which code a measurement beyond the limit is refused.
        name: What is limited, in words.
        found_mm: What was found.
        limit_mm: What is allowed.
    """

    code: str
    name: str
    found_mm: float
    limit_mm: float

    @property
    def passed(self) -> bool:
        """Whether it is allowed."""
        return self.found_mm <= self.limit_mm
