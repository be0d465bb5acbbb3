"""The SQL of the journal in one place: each text is one that SQLite and PostgreSQL both take.

``migrations`` makes the tables, and ``connection`` has the few words in which the databases differ.
"""

from collections.abc import Iterable
from dataclasses import fields
from functools import lru_cache
from typing import Final

from robolink.model import NO_HISTORY, Signature

_UNLESS_THERE: Final = "ON CONFLICT DO NOTHING"

COLUMNS: Final = (
    *("number", "at", "controller", "kind", "change", "operation"),
    *("tool", "tolerance", "verdict", "details", "proved_tool"),
    *(field.name for field in fields(Signature)),
    *("previous", "hash"),
)
"""Columns of the entries."""

_LISTED: Final = ", ".join(COLUMNS)

# ---- Entries

ADD_ENTRY: Final = (
    f"INSERT INTO entries ({_LISTED}) VALUES ({', '.join(f':{name}' for name in COLUMNS)})"
)
COUNT_ENTRIES: Final = "SELECT count(*) FROM entries"
LAST_ENTRY: Final = "SELECT max(number) FROM entries"
ENTRY_OF: Final = "SELECT number FROM entries WHERE controller = :of_name LIMIT 1"
HEAD: Final = "SELECT number, hash FROM head"
MOVE_HEAD: Final = (
    "UPDATE head SET number = :number, hash = :hash WHERE number = :of_number AND hash = :of_hash"
)

NAME, KIND = "name_", "kind_"
"""Prefixes of the parameters for several names and kinds."""

_WHERE: Final = {
    "tool": "tool = :tool",
    "proved_tool": "proved_tool = :proved_tool",
    # SQLite uses a partial index only for statements that repeat its condition word by word.
    "change": "change = :change AND change <> ''",
    "before": "number < :before",
    "after": "number > :after",
}


@lru_cache(maxsize=256)
def entries_where(places: tuple[str, ...], *, newest_first: bool, outside: bool) -> str:
    """Return the query for up to ``:limit`` entries that has these places.

    Args:
        places: Names of its values: those of single fields, names and kinds.
        newest_first: In which order.
        outside: Whether only entries outside of changes are meant.
    """
    wanted = [condition for name, condition in _WHERE.items() if name in places]
    if outside:
        wanted.append("change = ''")
    if any(name.startswith(NAME) for name in places):
        # A change has few entries and an index of its own. SQLite would prefer the index that gives
        # the order, and then scan all entries of the controller.
        column = "coalesce(controller, '')" if "change" in places else "controller"
        wanted.append(_one_of(column, NAME, places))
    if any(name.startswith(KIND) for name in places):
        wanted.append(_one_of("kind", KIND, places))
    where = f" WHERE {' AND '.join(wanted)}" if wanted else ""
    order = "number DESC" if newest_first else "number"
    return f"SELECT {_LISTED} FROM entries{where} ORDER BY {order} LIMIT :limit"


@lru_cache(maxsize=64)
def history_of(places: tuple[str, ...]) -> str:
    """Return the query for one change, or decision, under names in these places."""
    ours = _one_of("controller", NAME, places)
    passing = ", ".join(f"'{kind}'" for kind in NO_HISTORY)
    return f"SELECT number FROM entries WHERE {ours} AND kind NOT IN ({passing}) LIMIT 1"


@lru_cache(maxsize=64)
def subjects_of(places: tuple[str, ...]) -> str:
    """Return the query for tools and stations with entries under names in these places."""
    where = f" WHERE {_one_of('controller', NAME, places)}" if places else ""
    return f"SELECT DISTINCT tool, station FROM entries{where}"


def _one_of(column: str, beginning: str, places: Iterable[str]) -> str:
    found = [f":{name}" for name in places if name.startswith(beginning)]
    return f"{column} = {found[0]}" if len(found) == 1 else f"{column} IN ({', '.join(found)})"


# ---- Checks

CHECK_COLUMNS: Final = (
    *("number", "at", "controller", "cell", "well", "verdict", "details"),
    *(field.name for field in fields(Signature)),
    "hash",
)
"""Columns of the records of checks."""

ADD_CHECK: Final = (
    f"INSERT INTO checks ({', '.join(CHECK_COLUMNS)}) "
    f"VALUES ({', '.join(f':{name}' for name in CHECK_COLUMNS)})"
)
FIRST_CHECK_HEAD: Final = (
    "INSERT INTO check_head (number, closed, kept_from, day) VALUES (0, 0, 1, '')"
)
CHECK_HEAD: Final = "SELECT number, day FROM check_head"
CHECKED_CONTROLLERS: Final = "SELECT DISTINCT controller FROM checks"
COUNT_CHECKS: Final = "UPDATE check_head SET number = number + :count"
CLOSE_CHECKS: Final = "UPDATE check_head SET closed = :closed, kept_from = :kept_from, day = :day"
FORGET_CHECKS: Final = "DELETE FROM checks WHERE number <= :last"


@lru_cache(maxsize=64)
def checks_where(places: tuple[str, ...], *, newest_first: bool) -> str:
    """Return the query for up to ``:limit`` checks that has these places.

    Args:
        places: Names of its values: ``before``, ``after``, and names of a controller.
        newest_first: In which order.
    """
    wanted = [condition for name, condition in _WHERE.items() if name in places]
    if any(name.startswith(NAME) for name in places):
        wanted.append(_one_of("controller", NAME, places))
    where = f" WHERE {' AND '.join(wanted)}" if wanted else ""
    order = "number DESC" if newest_first else "number"
    return f"SELECT {', '.join(CHECK_COLUMNS)} FROM checks{where} ORDER BY {order} LIMIT :limit"


# ---- Markers

_MARKERS: Final = "SELECT controller, operation, kind, request, begun_at, details FROM markers"
_THE_MARKER: Final = "WHERE controller = :of_controller AND operation = :of_operation"
ALL_MARKERS: Final = f"{_MARKERS} ORDER BY id"
MARKERS_OF: Final = f"{_MARKERS} WHERE controller = :of_controller ORDER BY id"
ADD_MARKER: Final = f"""
    INSERT INTO markers (controller, operation, id, kind, request, begun_at, details)
    VALUES (
        :of_controller, :of_operation, (SELECT coalesce(max(id), 0) + 1 FROM markers),
        :kind, :request, :begun_at, :details
    ) {_UNLESS_THERE}
"""
CHANGE_MARKER: Final = (
    "UPDATE markers SET kind = :kind, request = :request, begun_at = :begun_at, "
    f"details = :details {_THE_MARKER}"
)
RENAME_MARKER: Final = (
    f"UPDATE markers SET controller = :to_controller, details = :details {_THE_MARKER}"
)
REMOVE_MARKER: Final = f"DELETE FROM markers {_THE_MARKER}"
CONTROLLERS_WITH_MARKERS: Final = """
    SELECT count(*) FROM (SELECT DISTINCT controller FROM markers LIMIT :at_most) AS open_here
"""

# ---- Leases

_OURS: Final = "controller = :of_controller AND epoch = :of_epoch AND token = :of_token"
_CLAIMED: Final = (
    "epoch = epoch + 1, token = :token, holder = :holder, beat_ns = :beat_ns, boot = :boot, "
    "taken_at = :taken_at, purpose = :purpose"
)
_LEASE: Final = "epoch, token, beat, beat_ns, holder, taken_at, purpose FROM leases"
LEASE: Final = f"SELECT {_LEASE} WHERE controller = :of_controller"
ALL_LEASES: Final = f"SELECT controller, {_LEASE} ORDER BY controller"
FIRST_LEASE: Final = f"""
    INSERT INTO leases
        (controller, epoch, token, holder, beat, beat_ns, boot, taken_at, purpose)
    VALUES
        (:of_controller, 1, :token, :holder, 0, :beat_ns, :boot, :taken_at, :purpose)
    {_UNLESS_THERE}
"""
RENEW_LEASE: Final = f"UPDATE leases SET beat = beat + 1, beat_ns = :now_ns WHERE {_OURS}"
RELEASE_LEASE: Final = f"UPDATE leases SET token = '' WHERE {_OURS}"
TAKE_LEASE: Final = f"UPDATE leases SET {_CLAIMED} WHERE {_OURS} AND beat = :of_beat"
END_LEASE: Final = f"UPDATE leases SET {_CLAIMED} WHERE controller = :of_controller"
# A lease under the controller's own name has priority.
MOVE_LEASE: Final = """
    UPDATE leases SET controller = :to_name WHERE controller = :of_name
    AND NOT EXISTS (SELECT 1 FROM leases AS other WHERE other.controller = :to_name)
"""

# ---- Names

MET_AT: Final = "SELECT controller FROM addresses WHERE address = :of_name"
PLACES_OF: Final = (
    "SELECT address FROM addresses WHERE controller = :of_name ORDER BY met_at DESC, address"
)
MEET_FIRST: Final = (
    "INSERT INTO addresses (address, controller, met_at) "
    f"VALUES (:of_name, :to_name, :met_at) {_UNLESS_THERE}"
)
MEET_AGAIN: Final = (
    "UPDATE addresses SET controller = :to_name, met_at = :met_at WHERE address = :of_name"
)
SUCCESSOR: Final = "SELECT controller FROM former_names WHERE name = :of_name"
FORMER_NAMES: Final = "SELECT name FROM former_names WHERE controller = :of_name ORDER BY name"
SUCCEED: Final = (
    f"INSERT INTO former_names (name, controller) VALUES (:of_name, :to_name) {_UNLESS_THERE}"
)
PASS_ON: Final = "UPDATE former_names SET controller = :to_name WHERE controller = :of_name"
ROBOTS_OF: Final = "SELECT name FROM robots WHERE controller = :of_name ORDER BY name"
ADD_ROBOT: Final = (
    f"INSERT INTO robots (name, controller) VALUES (:of_name, :to_name) {_UNLESS_THERE}"
)
ROBOT_OF: Final = "SELECT controller FROM robots WHERE name = :of_name"
MOVE_ROBOT: Final = "UPDATE robots SET controller = :to_name WHERE name = :of_name"
MARKER_OR_LEASE_OF: Final = (
    "SELECT controller FROM markers WHERE controller = :of_name "
    "UNION ALL SELECT controller FROM leases WHERE controller = :of_name"
)

# ---- Moves

PUT_HEAD: Final = "UPDATE head SET number = :number, hash = :hash"
MOVED_RECORDS: Final = """
    CREATE TABLE IF NOT EXISTS moved_records (
        name TEXT NOT NULL, state TEXT NOT NULL, place TEXT NOT NULL, at TEXT NOT NULL,
        number BIGINT NOT NULL, hash TEXT NOT NULL, PRIMARY KEY (name)
    )
"""
MOVES: Final = "SELECT name, state, place, at, number, hash FROM moved_records ORDER BY name"
ADD_MOVE: Final = """
    INSERT INTO moved_records (name, state, place, at, number, hash)
    VALUES (:name, :state, :place, :at, :number, :hash)
"""
REMOVE_MOVE: Final = "DELETE FROM moved_records WHERE name = :name"
ADD_TO_VERSION: Final = "UPDATE schema_version SET version = version + :much WHERE version < :much"
TAKE_FROM_VERSION: Final = (
    "UPDATE schema_version SET version = version - :much WHERE version >= :much"
)
CONTROLLERS: Final = "SELECT DISTINCT controller FROM entries"


def all_of_table(table: str) -> str:
    """Return the query for all rows of a table."""
    return f"SELECT * FROM {table}"


def empty_table(table: str) -> str:
    """Return the statement that removes all rows of a table."""
    return f"DELETE FROM {table}"


def add_to_table(table: str, columns: Iterable[str]) -> str:
    """Return the statement that adds a row to a table, with values by the names of its columns."""
    named = tuple(columns)
    return (
        f"INSERT INTO {table} ({', '.join(named)}) "
        f"VALUES ({', '.join(f':{name}' for name in named)})"
    )


# ---- All of them

UNFINISHED: Final = "SELECT 1 FROM markers UNION ALL SELECT 1 FROM leases WHERE token <> '' LIMIT 1"
VERSION: Final = "SELECT version FROM schema_version"
SET_VERSION: Final = "UPDATE schema_version SET version = :own"
