"""The SQL of the fleet in one place: each text is one that SQLite and PostgreSQL both take."""

from typing import Final

_UNLESS_THERE: Final = "ON CONFLICT DO NOTHING"

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

# ---- Plans

ADD_PLAN: Final = (
    "INSERT INTO plans (plan, plant, made_at, document, cancelled_at) "
    f"VALUES (:plan, :plant, :at, :document, '') {_UNLESS_THERE}"
)
PLAN: Final = "SELECT document, cancelled_at FROM plans WHERE plan = :plan"
PLANS: Final = "SELECT document, cancelled_at FROM plans ORDER BY made_at DESC, plan"
NEWEST_PLANS: Final = f"{PLANS} LIMIT :most"
OPEN_PLANS: Final = (
    "SELECT plan FROM plans WHERE plant = :plant AND EXISTS (SELECT 1 FROM outcomes "
    "WHERE outcomes.plan = plans.plan AND state IN ('waiting', 'running')) ORDER BY made_at, plan"
)
LOCK_PLAN: Final = "SELECT cancelled_at FROM plans WHERE plan = :plan"
CANCEL_PLAN: Final = "UPDATE plans SET cancelled_at = :at WHERE plan = :plan"

# ---- Jobs and their outcomes

JOB_COLUMNS: Final = (
    *("plan", "cell", "ring", "state", "attempt", "begun_at", "ended_at", "code"),
    *("error", "reason", "what", "change", "treatment", "sequence"),
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
DELIVER_AGAIN: Final = (
    "UPDATE outcomes SET state = 'waiting', treatment = '', sequence = 0 "
    "WHERE plan = :plan AND (state = 'unsettled' OR (state = 'waiting' AND error = 'BusyError'))"
)
CANCEL_JOBS: Final = (
    "UPDATE outcomes SET state = 'cancelled', ended_at = :at "
    "WHERE plan = :plan AND state = 'waiting'"
)
COUNTS: Final = (
    "SELECT ring, state, count(*), sum(CASE WHEN sequence > :after THEN 1 ELSE 0 END), "
    "sum(judged) FROM outcomes WHERE plan = :plan GROUP BY ring, state"
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
