"""What the journal is asked for, and what it gives back."""

from dataclasses import dataclass, field

from robolink.model import EntryKind


@dataclass(frozen=True, slots=True)
class ChainVerification:
    """Whether the record is whole.

    Attributes:
        checked: How many entries were read.
        problems: What is wrong, one sentence each, with the number of the entry.
        last_number: Number of the last entry, 0 for none.
        last_hash: Its hash. The chain has no key, so only a hash that is kept elsewhere shows
            that the whole journal was not made anew.
    """

    checked: int
    problems: tuple[str, ...]
    last_number: int = field(default=0, compare=False)
    last_hash: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class Filter:
    """Which entries are wanted.

    Attributes:
        controllers: Of the controller with these names only; empty for all.
        tool: About this tool only.
        change: Of this tool change only.
        kinds: Of these kinds only; empty for all.
        newest_first: In which order.
        proved_tool: Those only that prove what this tool holds.
    """

    controllers: tuple[str, ...] = ()
    tool: int | None = None
    change: str | None = None
    kinds: tuple[EntryKind, ...] = ()
    newest_first: bool = True
    proved_tool: int | None = None
