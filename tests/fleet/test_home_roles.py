"""A home at the plant's database: its role may do what it has to, and no more; its link is TLS."""

import os
import re
import shutil
import subprocess
from datetime import UTC, datetime
from pathlib import Path

import pytest

from robolink.fleet import FleetStore, JobOutcome, JobState, Permit, PlantError, plan_of
from robolink.fleet.agent import Agent
from tests.contract.journal._postgresql import asked
from tests.fleet._plans import cells_of

pytestmark = pytest.mark.soak

CELLS = cells_of(4)
HOMES = dict(zip(CELLS, ["PC7", "PC7", "PC8", "PC7"], strict=True))


def granted():
    """The statements of the page, as they stand there."""
    page = Path("docs/fleet.md").read_text(encoding="utf-8")
    (found,) = re.findall(r"```sql\n(.*?)```", page, re.DOTALL)
    return found


def offsets(**keys):
    table = {"schema": "robolink/fleet-plan/1", "kind": "offset", "name": "test", "cells": CELLS}
    values = {"offsets": {cell: {"tool": 1, "x_mm": 12.0} for cell in CELLS}}
    return plan_of({**table, **values, "rings": ["rest"], **keys}, cells=CELLS, homes=HOMES)


def permit():
    return Permit(0, "plant", "Chen", "engineer", "2020-01-01", "2999-01-01", given_by="Li")


@pytest.fixture
def database(server, monkeypatch):
    """The database as its owner has made it, by an agent that found nothing to do."""
    monkeypatch.setattr("platform.node", lambda: "office")
    url = server.empty_database()
    Agent(url, "plant", lambda *_: JobOutcome(0)).run_until_still()
    yield url
    for role in ("pc7",):
        asked(url, f"DROP OWNED BY {role}; DROP ROLE {role}")


def test_a_home_carries_out_its_jobs_and_makes_no_plan(database, monkeypatch):
    for statement in filter(None, map(str.strip, granted().split(";"))):
        asked(database, statement)
    plan = offsets()
    with FleetStore(database) as owner:
        owner.add_plan(plan)
        owner.give_permit(permit())
    monkeypatch.setattr("platform.node", lambda: "PC7")
    of_role = database.replace("journal@", "pc7@")
    told: list[str] = []
    agent = Agent(of_role, "plant", lambda *_: JobOutcome(0), tell=told.append)
    agent.run_until_still()
    assert told == []
    with FleetStore(of_role) as store:
        states = [job.state for job in store.progress(plan.id).jobs]
        assert states == [
            JobState.UNPROVED,
            JobState.UNPROVED,
            JobState.WAITING,
            JobState.UNPROVED,
        ]
        assert [home.home for home in store.homes()] == ["office", "PC7"]
        other = offsets(name="another")
        store.halt(plan.id, "Chen", "the line stands")  # anybody may halt
        now = datetime.now(UTC).isoformat(timespec="seconds")
        for forbidden in (
            lambda: store.add_plan(other),
            lambda: store.give_permit(permit()),
            lambda: store.revoke_permit(1, "Chen"),
            lambda: store.resume(plan.id, "Chen", "it runs"),
            lambda: store.cancel(plan.id, "Chen"),
        ):
            with pytest.raises(PlantError, match="permission denied"):
                forbidden()
    for table in ("plans", "outcomes", "halts", "permits", "cells", "homes", "fleet_version"):
        with pytest.raises(Exception, match="permission denied"):
            asked(of_role, f"DELETE FROM fleet.{table}")
    with pytest.raises(Exception, match="permission denied"):
        asked(of_role, f"UPDATE fleet.plans SET document = '', made_at = '{now}'")


def test_a_role_that_may_not_change_older_tables_is_told_so(database, monkeypatch):
    from robolink.fleet.store import migrations

    asked(database, "CREATE ROLE pc7 LOGIN")
    asked(database, "GRANT USAGE ON SCHEMA fleet TO pc7")
    asked(database, "GRANT SELECT ON ALL TABLES IN SCHEMA fleet TO pc7")
    newest = len(migrations.MIGRATIONS)
    asked(database, f"UPDATE fleet.fleet_version SET version = {newest - 1}")
    with (
        FleetStore(database.replace("journal@", "pc7@")) as store,
        pytest.raises(PlantError, match="is older than this robolink") as told,
    ):
        store.plans()
    assert type(told.value).__name__ == "PlantVersionError"
    assert "fleet status" in told.value.remedy
    asked(database, f"UPDATE fleet.fleet_version SET version = {newest}")


def certified(folder, name):
    """Return a certificate for a name or an address, and its key."""
    paths = folder / f"{name}.crt", folder / f"{name}.key"
    words = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256"]
    words += ["-nodes", "-days", "2", "-subj", "/CN=db.plant", "-out", str(paths[0])]
    kind = "IP" if name[0].isdigit() else "DNS"
    subprocess.run(
        [*words, "-keyout", str(paths[1]), "-addext", f"subjectAltName={kind}:{name}"],
        check=True,
        capture_output=True,
    )
    return paths


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed here")
def test_a_home_talks_to_the_server_of_its_certificate_alone(server, tmp_path):
    owner = (server.folder / "data").stat()

    def shows(certificate, key):
        for path, name in ((certificate, "server.crt"), (key, "server.key")):
            there = server.folder / "data" / name
            there.write_bytes(path.read_bytes())
            there.chmod(0o600)
            os.chown(there, owner.st_uid, owner.st_gid)
        server.execute("ALTER SYSTEM SET ssl = on")
        server.execute("SELECT pg_reload_conf()")

    right, other = certified(tmp_path, "127.0.0.1"), certified(tmp_path, "db.plant")
    database = server.empty_database()
    url = f"{database}?sslmode=verify-full&sslrootcert={right[0]}"
    with pytest.raises(PlantError, match="SSL"), FleetStore(url) as store:
        store.plans()  # the server speaks no TLS
    try:
        shows(*right)
        agent = Agent(url, "plant", lambda *_: JobOutcome(0))  # lock, plans and queue
        agent.run_until_still()
        with FleetStore(url) as store:
            assert len(store.homes()) == 1
        encrypted = "SELECT bool_and(ssl) FROM pg_stat_ssl WHERE pid = pg_backend_pid()"
        assert asked(url, encrypted) == [(True,)]
        for certificate, trusted in ((other, right), (other, other)):  # another one; another name
            shows(*certificate)
            wrong = f"{database}?sslmode=verify-full&sslrootcert={trusted[0]}"
            with pytest.raises(PlantError, match="certificate"), FleetStore(wrong) as store:
                store.plans()
    finally:
        server.execute("ALTER SYSTEM SET ssl = off")
        server.execute("SELECT pg_reload_conf()")
