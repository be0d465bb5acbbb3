"""The SQL of the fleet in one place: each text is one that SQLite and PostgreSQL both take."""

from typing import Final

_UNLESS_THERE: Final = "ON CONFLICT DO NOTHING"
_OPEN: Final = "state IN ('waiting', 'running')"
"""In these words both databases know that the index of what is open serves."""

VERSION: Final = "SELECT version FROM fleet_version"
SET_VERSION: Final = "UPDATE fleet_version SET version = :own"

# ---- Plants and cells

ADD_PLANT: Final = f"INSERT INTO plants (plant, made_at) VALUES (:plant, :at) {_UNLESS_THERE}"
PLANTS: Final = "SELECT plant FROM plants ORDER BY plant"
ADD_CELL: Final = (
    f"INSERT INTO cells (plant, cell, at_work) VALUES (:plant, :cell, '') {_UNLESS_THERE}"
)
AT_WORK: Final = "SELECT at_work FROM cells WHERE plant = :plant AND cell = :cell"
ALL_AT_WORK: Final = "SELECT cell, at_work FROM cells WHERE plant = :plant AND at_work <> ''"
SET_AT_WORK: Final = "UPDATE cells SET at_work = :order_id WHERE plant = :plant AND cell = :cell"
FREE_CELL: Final = (
    "UPDATE cells SET at_work = '' WHERE plant = :plant AND cell = :cell AND at_work = :order_id"
)

# ---- Homes

HEAR_HOME: Final = (
    "INSERT INTO homes (plant, home, name, heard_at, agent) "
    "VALUES (:plant, :home, :name, :at, :agent) ON CONFLICT (plant, home) "
    "DO UPDATE SET name = :name, heard_at = :at, agent = :agent"
)
HOMES: Final = "SELECT plant, name, heard_at, agent FROM homes ORDER BY plant, home"
HOMES_OF: Final = "SELECT plant, name, heard_at, agent FROM homes WHERE plant = :plant"

# ---- Plans

ADD_PLAN: Final = (
    "INSERT INTO plans (plan, plant, made_at, document, cancelled_at) "
    f"VALUES (:plan, :plant, :at, :document, '') {_UNLESS_THERE}"
)
PLAN: Final = "SELECT document, cancelled_at, home FROM plans WHERE plan = :plan"
PLANS: Final = "SELECT document, cancelled_at FROM plans ORDER BY made_at DESC, plan"
RECENT_PLANS: Final = (
    "SELECT document, cancelled_at FROM plans WHERE :plant IN ('', plant) AND plan IN ("
    "SELECT plan FROM plans WHERE plant = :plant AND made_at >= :since UNION "
    "SELECT plan FROM (SELECT plan FROM plans WHERE plant = :plant "
    "ORDER BY made_at DESC, plan LIMIT :most) AS newest UNION "
    f"SELECT plan FROM outcomes WHERE {_OPEN}) ORDER BY made_at DESC, plan"
)
NEWEST_PLANS: Final = f"{PLANS} LIMIT :most"
OPEN_PLANS: Final = (
    "SELECT plan FROM plans WHERE :plant IN ('', plant) AND plan IN (SELECT plan FROM outcomes "
    f"WHERE {_OPEN} AND :cell IN ('', cell)) ORDER BY made_at, plan"
)
LOCK_PLAN: Final = "SELECT cancelled_at, home FROM plans WHERE plan = :plan"
BIND_PLAN: Final = "UPDATE plans SET home = :home WHERE plan = :plan AND home = ''"
CANCEL_PLAN: Final = "UPDATE plans SET cancelled_at = :at WHERE plan = :plan"

# ---- Jobs and their outcomes

JOB_COLUMNS: Final = (
    *("plan", "cell", "ring", "state", "attempt", "begun_at", "ended_at", "code"),
    *("error", "reason", "what", "change", "treatment", "sequence", "proof"),
)
_JOBS: Final = f"SELECT {', '.join(JOB_COLUMNS)} FROM outcomes WHERE plan = :plan"
ADD_JOB: Final = (
    "INSERT INTO outcomes (plan, cell, ring, place, state, attempt, begun_at, ended_at, code, "
    "error, reason, what, change, treatment, judged, corrections, sequence) "
    "VALUES (:plan, :cell, :ring, :place, 'waiting', 0, '', '', NULL, '', '', '', '', '', 0, '', 0)"
)
JOBS: Final = f"{_JOBS} ORDER BY place"
JOB: Final = f"{_JOBS} AND cell = :cell"
VAIN_JOBS: Final = f"{_JOBS} AND state = 'waiting' AND treatment <> '' ORDER BY place"
CORRECTIONS_OF: Final = "SELECT corrections FROM outcomes WHERE plan = :plan AND cell = :cell"
BEGIN_JOB: Final = (
    "UPDATE outcomes SET state = 'running', attempt = attempt + 1, begun_at = :at "
    "WHERE plan = :plan AND cell = :cell AND state = 'waiting'"
)
END_JOB: Final = (
    "UPDATE outcomes SET state = :state, ended_at = :at, code = :code, error = :error, "
    "reason = :reason, what = :what, change = :change, treatment = :treatment, judged = :judged, "
    "corrections = :corrections, sequence = :sequence WHERE plan = :plan AND cell = :cell"
)
UNPROVED: Final = (
    "SELECT outcomes.plan, cell FROM outcomes JOIN plans ON plans.plan = outcomes.plan "
    "WHERE plans.plant = :plant AND state = 'unproved' ORDER BY plans.made_at, outcomes.place"
)
PROVE_JOB: Final = (
    "UPDATE outcomes SET state = 'kept', proof = :proof "
    "WHERE plan = :plan AND cell = :cell AND state = 'unproved'"
)
DELIVER_AGAIN: Final = (
    "UPDATE outcomes SET state = 'waiting', treatment = '', sequence = 0 "
    "WHERE plan = :plan AND (state = 'unsettled' OR (state = 'refused' AND treatment = 'halt') "
    "OR (state = 'waiting' AND error = 'BusyError'))"
)
CANCEL_JOBS: Final = (
    "UPDATE outcomes SET state = 'cancelled', ended_at = :at "
    "WHERE plan = :plan AND state = 'waiting'"
)
COUNTS: Final = (
    "SELECT ring, state, count(*), sum(CASE WHEN sequence > :after THEN 1 ELSE 0 END), "
    "sum(judged), sum(CASE WHEN treatment = 'halt' THEN 1 ELSE 0 END) "
    "FROM outcomes WHERE plan = :plan GROUP BY ring, state"
)
STATES: Final = "SELECT state, count(*) FROM outcomes WHERE plan = :plan GROUP BY state"
RUNNING: Final = "SELECT count(*) FROM outcomes WHERE plan = :plan AND state = 'running'"
OPEN_RING: Final = (
    "SELECT min(ring) FROM outcomes WHERE plan = :plan AND state IN ('waiting', 'running')"
)
LAST_SEQUENCE: Final = "SELECT coalesce(max(sequence), 0) FROM outcomes WHERE plan = :plan"
JUDGED: Final = (
    "SELECT corrections FROM outcomes WHERE plan = :plan AND judged = 1 AND sequence > :after "
    "AND ring BETWEEN :first AND :last ORDER BY sequence"
)

# ---- Halts

HALT_COLUMNS: Final = (
    *("plan", "number", "at", "rule", "cell", "numbers", "by_whom", "lifted_at", "lifted_by"),
    "reason",
)
_HALTS: Final = f"SELECT {', '.join(HALT_COLUMNS)} FROM halts WHERE plan = :plan"
HALTS: Final = f"{_HALTS} ORDER BY number"
STANDING: Final = f"{_HALTS} AND lifted_at = '' ORDER BY number"
ADD_HALT: Final = (
    "INSERT INTO halts (plan, number, at, rule, cell, numbers, by_whom, lifted_at, lifted_by, "
    "reason, accepted, accepted_until) VALUES (:plan, (SELECT coalesce(max(number), 0) + 1 FROM "
    "halts WHERE plan = :plan), :at, :rule, :cell, :numbers, :by_whom, '', '', '', '', 0)"
)
LIFT_HALTS: Final = (
    "UPDATE halts SET lifted_at = :at, lifted_by = :by_whom, reason = :reason, "
    "accepted = :accepted, accepted_until = :until WHERE plan = :plan AND lifted_at = '' "
    "AND number <= :last"
)
ACCEPTED: Final = (
    "SELECT accepted, accepted_until FROM halts WHERE plan = :plan AND accepted <> '' "
    "ORDER BY number DESC LIMIT 1"
)

# ---- Permits

PERMIT_COLUMNS: Final = (
    *("number", "plant", "person", "role", "from_at", "until_at", "permit_group", "plan"),
    *("given_by", "given_at", "revoked_by", "revoked_at"),
)
_PERMITS: Final = f"SELECT {', '.join(PERMIT_COLUMNS)} FROM permits"
PERMITS: Final = f"{_PERMITS} ORDER BY number"
PERMITS_OF: Final = f"{_PERMITS} WHERE plant = :plant AND revoked_at = '' ORDER BY number"
PERMIT: Final = f"{_PERMITS} WHERE number = :number"
NEXT_PERMIT: Final = "SELECT coalesce(max(number), 0) + 1 FROM permits"
ADD_PERMIT: Final = (
    "INSERT INTO permits (number, plant, person, role, from_at, until_at, permit_group, plan, "
    "given_by, given_at, revoked_by, revoked_at) VALUES (:number, :plant, :person, :role, "
    ":from_at, :until_at, :permit_group, :plan, :given_by, :given_at, '', '')"
)
REVOKE_PERMIT: Final = (
    "UPDATE permits SET revoked_by = :by_whom, revoked_at = :at "
    "WHERE number = :number AND revoked_at = ''"
)

# ---- Jobs of line computers

LINE_JOB_COLUMNS: Final = ("line", "order_id", "plan", "cell", "posted_at", "body")
_LINE_JOBS: Final = (
    f"SELECT {', '.join(LINE_JOB_COLUMNS)} FROM line_jobs WHERE order_id = :order_id"
)
ADD_LINE_JOB: Final = (
    "INSERT INTO line_jobs (line, order_id, plan, cell, posted_at, body) "
    f"VALUES (:line, :order_id, :plan, :cell, :at, :body) {_UNLESS_THERE}"
)
OPEN_LINE_JOBS: Final = (
    "SELECT count(*) FROM line_jobs WHERE line = :line AND plan IN "
    f"(SELECT plan FROM outcomes WHERE {_OPEN})"
)
LINE_JOB: Final = f"{_LINE_JOBS} AND line = :line"
LINE_JOBS: Final = f"{_LINE_JOBS} ORDER BY posted_at, line"

# ---- What a plant sees

CELL_STATES: Final = (
    "SELECT cell, noted_at, document FROM cell_states WHERE plant = :plant ORDER BY cell"
)
UNNOTED_CELLS: Final = (
    "SELECT cell FROM cells WHERE plant = :plant AND NOT EXISTS (SELECT 1 FROM cell_states "
    "WHERE cell_states.plant = cells.plant AND cell_states.cell = cells.cell) ORDER BY cell"
)
CELL_STATE: Final = (
    "SELECT noted_at, document FROM cell_states WHERE plant = :plant AND cell = :cell"
)
NOTE_CELL: Final = (
    "INSERT INTO cell_states (plant, cell, noted_at, document) "
    "VALUES (:plant, :cell, :at, :document) ON CONFLICT (plant, cell) DO UPDATE "
    "SET noted_at = excluded.noted_at, document = excluded.document"
)
# The row of the last event is locked until the end of its transaction: so events become visible
# in the order of their numbers, and who has read up to one has read all before it.
NEXT_EVENT: Final = "UPDATE last_event SET number = number + 1"
ADD_EVENT: Final = (
    "INSERT INTO events (number, plant, at, document) "
    "VALUES ((SELECT number FROM last_event), :plant, :at, :document)"
)
EVENTS: Final = (
    "SELECT number, document FROM events WHERE plant = :plant AND number > :after "
    "ORDER BY number LIMIT :most"
)
LAST_EVENT: Final = "SELECT number FROM last_event"
POSITION: Final = "SELECT chain, number FROM positions WHERE name = :name"
SET_POSITION: Final = (
    "INSERT INTO positions (name, chain, number) VALUES (:name, :chain, :number) "
    "ON CONFLICT (name) DO UPDATE SET chain = excluded.chain, number = excluded.number"
)
# Copies at the plant: PostgreSQL alone takes them (robolink/journal/_plant.py).
TAKES_COPIES: Final = "SELECT to_regclass('fleet.cell_heads')"
BEHIND: Final = (
    "SELECT coalesce(sum(greatest(positions.number - coalesce(cell_heads.number, 0), 0)), 0) "
    "FROM positions LEFT JOIN cell_heads ON cell_heads.chain = positions.chain "
    "WHERE positions.name LIKE :journals"
)
