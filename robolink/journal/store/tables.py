"""The tables as statements see them; ``migrations`` makes them."""

from dataclasses import fields
from typing import Final

from sqlalchemy import BigInteger, Integer, Text, column, table, text

from robolink.model import Signature

ENTRIES: Final = table(
    "entries",
    column("number", BigInteger),
    column("at", Text),
    column("controller", Text),
    column("kind", Text),
    column("change", Text),
    column("operation", Text),
    column("tool", Integer),
    column("tolerance", Text),
    column("verdict", Text),
    column("details", Text),
    column("proved_tool", Integer),
    *(column(field.name, Text) for field in fields(Signature)),
    column("previous", Text),
    column("hash", Text),
)

# An index over some entries only is used by statements that say the same, word by word.
IN_A_CHANGE: Final = text("change <> ''")

HEAD: Final = table("head", column("number", BigInteger), column("hash", Text))

MARKERS: Final = table(
    "markers",
    column("controller", Text),
    column("operation", Text),
    column("id", BigInteger),
    column("kind", Text),
    column("request", Text),
    column("begun_at", Text),
    column("details", Text),
)

LEASES: Final = table(
    "leases",
    column("controller", Text),
    column("epoch", BigInteger),
    column("token", Text),
    column("holder", Text),
    column("beat", BigInteger),
    column("beat_ns", BigInteger),
    column("boot", Text),
    column("taken_at", Text),
    column("purpose", Text),
)

ADDRESSES: Final = table(
    "addresses",
    column("address", Text),
    column("controller", Text),
    column("met_at", Text),
)

FORMER_NAMES: Final = table("former_names", column("name", Text), column("controller", Text))

ROBOTS: Final = table("robots", column("name", Text), column("controller", Text))

SCHEMA_VERSION: Final = table("schema_version", column("version", Integer))
