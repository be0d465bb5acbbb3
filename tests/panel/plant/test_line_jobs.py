"""Jobs that line computers post: each once, durable before the answer, and never past a token."""

import io
import json
import os
import re
import signal
import sqlite3
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout, suppress
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_cli.panel.guard import line_gate
from robolink_cli.panel.guard.line_tokens import LineTokens

from robolink.fleet import FleetStore, JobOutcome, JobState, LineJobStore, PlanKind
from robolink.fleet.store import line_jobs as stored_line_jobs
from tests._documents import wrong_in
from tests._json_schema import Schemas
from tests.panel.plant._served import LineComputer, token_of
from tools.jobs_openapi import jobs_openapi

CHECK = {"order": "A-17/3", "cell": "line3-a", "kind": "check"}
OFFSET = {"order": "A-18", "cell": "line3-a", "kind": "offset", "offset": {"tool": 1, "x_mm": 12}}


def plans(location):
    with FleetStore(location) as store:
        return store.plans() if store.made else ()


def test_a_job_is_a_plan_of_one_cell_on_record_when_the_answer_comes(line, location):
    status, said, headers = line.post(CHECK)
    assert (status, said["state"], said["why"], said["final"]) == (201, "waiting", "turn", False)
    (plan,) = plans(location)
    assert (plan.id, plan.name, plan.kind) == (said["plan"], "A-17/3", PlanKind.CHECK)
    assert (plan.rings, plan.author) == ((("line3-a",),), "mes (line computer)")
    assert said["journal_order"] == f"{plan.id}/line3-a"
    assert line.get("A-17/3")[:2] == (200, said)
    assert headers["location"] == "/jobs/A-17%2F3"
    with FleetStore(location) as store:
        attempt = store.begin(plan.id, "line3-a").job.attempt
        store.record_outcome(plan.id, "line3-a", attempt, JobOutcome(1, what="Tool 2 changed."))
    said = line.get("A-17/3")[1]
    assert (said["final"], said["exit_code"], said["what"]) == (True, 1, "Tool 2 changed.")


def test_the_same_order_is_one_job_however_often_it_comes(line, location):
    first = line.post(CHECK)
    again = line.post(dict(reversed(CHECK.items())))
    assert (first[0], again[0]) == (201, 200)
    assert again[1] == first[1]
    assert len(plans(location)) == 1


def test_a_burst_of_one_order_makes_one_job(panel, line, location):
    with ThreadPoolExecutor(20) as pool:
        found = list(pool.map(lambda _: line.post(OFFSET)[:2], range(20)))
    assert sorted(status for status, _ in found) == [200] * 19 + [201]
    assert len({said["plan"] for _, said in found}) == 1
    assert len(plans(location)) == 1
    assert [kind for kind, _, _ in panel.kept] == ["ordered"]


@pytest.mark.soak
def test_two_panels_of_one_plant_make_one_job(line, location):
    """Each has a connection of its own; the database decides which was first."""
    from robolink.fleet import line_order_of

    asked = line_order_of(CHECK)

    def order(number):
        with LineJobStore(location) as store:
            plan = asked.plan(f"mes{number % 1}", cells=["line3-a"], recipes={})
            return store.order_job("mes0", asked, plan).plan

    with ThreadPoolExecutor(8) as pool:
        assert len(set(pool.map(order, range(8)))) == 1
    assert len(plans(location)) == 1


@pytest.mark.parametrize(
    ("changed", "differs"),
    [
        ({"cell": "line3-b"}, ["cell"]),
        ({"kind": "backup"}, ["kind"]),
        ({"window": "22:00-05:00"}, ["window"]),
    ],
)
def test_another_job_under_the_same_order_is_a_conflict_that_says_what_differs(
    line, location, changed, differs
):
    line.post(CHECK)
    status, said, _ = line.post(CHECK | changed)
    assert (status, said["differs"]) == (409, differs)
    assert all(name in said["why"] for name in differs)
    assert len(plans(location)) == 1


def test_a_token_names_no_other_group_of_permits_than_its_own(panel, line, location):
    """Else who has the token of one line would wait for the permit of another."""
    assert line.post({**OFFSET, "permit": "north"})[0] == 403
    assert plans(location) == ()
    north = LineComputer(panel.port, token_of("north", permit="north"))
    assert north.post({**OFFSET, "permit": "south"})[0] == 403
    assert plans(location) == ()
    assert north.post(OFFSET)[0] == 201
    assert north.post({**OFFSET, "permit": "north"})[0] == 200
    assert [plan.permit for plan in plans(location)] == ["north"]
    renewed = LineComputer(panel.port, token_of("north", permit="south"))
    assert renewed.post(OFFSET)[0] == 200, "the job is as it was"
    assert renewed.post({**OFFSET, "permit": "south"})[0] == 409
    assert [plan.permit for plan in plans(location)] == ["north"]


def test_the_group_of_a_token_is_given_with_it_and_shown(panel):
    def document(*words):
        said = io.StringIO()  # the token is shown by design, here alone
        with redirect_stdout(said):
            assert main.run(["panel", "token", *words, "--json"]) == 0
        found = json.loads(said.getvalue())
        assert wrong_in(found) == []
        return found

    wanted = ("--kind", "offset", "--cell", "line3-a", "--until", "2099-01-01", "--replace")
    given = document("give", "given", *wanted, "--permit", "north")
    assert given["permit"] == "north"
    assert document("give", "free", *wanted)["permit"] is None
    shown = {one["name"]: one["permit"] for one in document("list")["tokens"]}
    assert (shown["given"], shown["free"]) == ("north", None)
    assert LineComputer(panel.port, given["token"]).post(OFFSET | {"permit": "south"})[0] == 403


def test_a_token_of_an_older_robolink_counts_and_has_no_group(panel, line, location):
    (path,) = [
        one
        for one in (Path(os.environ["ROBOLINK_STATE_DIR"]) / "panel" / "line-tokens").glob("*")
        if json.loads(one.read_text())["name"] == "mes"
    ]
    said = json.loads(path.read_text())
    del said["permit"]
    path.write_text(json.dumps(said))
    assert line.post(OFFSET | {"permit": "north"})[0] == 403
    assert line.post(OFFSET)[0] == 201


def test_a_line_computer_that_never_stops_ordering_has_few_jobs_open(
    panel, line, location, monkeypatch
):
    monkeypatch.setattr(stored_line_jobs, "MOST_OPEN", 3)
    for number in range(3):
        assert line.post({**CHECK, "order": f"A-{number}"})[0] == 201
    status, said, headers = line.post({**CHECK, "order": "A-3"})
    assert (status, headers["retry-after"]) == (429, "60")
    assert "mes has 3 jobs that have not ended" in said["why"]
    assert len(plans(location)) == 3
    assert line.get("A-3")[0] == 404
    assert line.post({**CHECK, "order": "A-2"})[0] == 200, "one that is there is told"
    other = LineComputer(panel.port, token_of("plc"))
    assert other.post(CHECK)[0] == 201, "those of others do not count"
    plan = line.get("A-0")[1]["plan"]
    with FleetStore(location) as store:
        attempt = store.begin(plan, "line3-a").job.attempt
        store.record_outcome(plan, "line3-a", attempt, JobOutcome(0))
    assert line.post({**CHECK, "order": "A-3"})[0] == 201


@pytest.mark.soak
def test_a_component_that_differs_is_a_conflict_too(line):
    line.post(OFFSET)
    other = OFFSET | {"offset": {"tool": 1, "x_mm": 12.001}}
    assert line.post(other)[:2][0] == 409
    assert line.post(OFFSET | {"offset": {"x_mm": 12.0, "tool": 1}})[0] == 200


@pytest.mark.soak
def test_two_line_computers_may_count_alike(panel, line, location):
    other = LineComputer(panel.port, token_of("plc"))
    assert line.post(CHECK)[0] == other.post(CHECK | {"cell": "line3-b"})[0] == 201
    assert other.get("A-17/3")[1]["cell"] == "line3-b"
    assert line.get("A-17/3")[1]["cell"] == "line3-a"
    assert len(plans(location)) == 2


def test_a_new_token_of_the_same_name_knows_its_orders(panel, line):
    first = line.post(CHECK)[1]
    renewed = LineComputer(panel.port, token_of())
    assert renewed.post(CHECK)[:2] == (200, first)
    assert line.post(CHECK)[0] == 401


def test_what_changes_something_waits_for_a_permit_and_what_moves_for_its_recipe(line, location):
    assert line.post(OFFSET)[1]["waits_for"] == "no permit holds now"
    (plan,) = plans(location)
    assert dict(plan.offsets["line3-a"]) == {"tool": 1, "x_mm": 12.0}
    recipe = Path(__file__).parents[3] / "examples" / "recipes" / "scara-pin.toml"
    Path("needle.toml").write_text(recipe.read_text().replace("scara-pin", "needle"))
    name = _name_of_recipe()
    for kind in ("recipe", "nozzle_change"):
        status, said, _ = line.post({**CHECK, "order": kind, "kind": kind, "recipe": name})
        assert (status, said["why"]) == (201, "permit"), said
    (frozen,) = [plan for plan in plans(location) if plan.name == "recipe"]
    assert Path(frozen.recipe) == Path("needle.toml").absolute()
    Path("needle.toml").unlink()  # what was ordered is answered all the same
    again = line.post({**CHECK, "order": "recipe", "kind": "recipe", "recipe": name})
    assert again[0] == 200


def _name_of_recipe():
    from robolink.recipe import load_recipe

    return load_recipe(Path("needle.toml")).name


WRONG = [
    ({}, {"order", "cell", "kind"}),
    ({**CHECK, "cell": "nowhere"}, {"cell"}),
    ({**CHECK, "cell": 3, "kind": "dance", "orders": 1}, {"cell", "kind", "orders"}),
    ({**CHECK, "order": "x" * 65}, {"order"}),
    ({**CHECK, "order": "caf\u00e9"}, {"order"}),
    ({**CHECK, "order": ""}, {"order"}),
    ({**CHECK, "window": "25:00-26:00"}, {"window"}),
    ({**CHECK, "kind": "recipe"}, {"recipe"}),
    ({**CHECK, "kind": "recipe", "recipe": "nothing"}, {"recipe"}),
    ({**CHECK, "kind": "nozzle_change", "recipe": "../../etc/passwd"}, {"recipe"}),
    ({**CHECK, "recipe": "needle"}, {"recipe"}),
    ({**OFFSET, "offset": {"tool": 0, "x_mm": 1}}, {"offset.tool"}),
    ({**OFFSET, "offset": {"tool": 1}}, {"offset"}),
    ({**OFFSET, "offset": {"tool": 1, "x": 1}}, {"offset.x"}),
    ({**OFFSET, "kind": "check"}, {"offset"}),
]


@pytest.mark.parametrize(
    ("said", "fields"),
    [
        pytest.param(*one, marks=[pytest.mark.soak] * (at > 3), id=str(at))
        for at, one in enumerate(WRONG)
    ],
)
def test_what_cannot_be_ordered_is_refused_with_all_problems(line, location, said, fields):
    status, answer, _ = line.post(said)
    assert status == 422, answer
    assert {one["field"] for one in answer["problems"]} == fields
    assert all(one["what"] for one in answer["problems"])
    assert plans(location) == ()


@pytest.mark.parametrize(
    "body", [b"", b"[]", b"{", b'{"order": NaN}', b'{"a": 1, "a": 2}', b"\xff"]
)
def test_what_is_no_json_object_is_no_job(line, location, body):
    assert line.ask("POST", "/jobs", body)[0] == 400
    assert plans(location) == ()


def test_a_long_body_and_another_form_are_refused(line, location):
    assert line.ask("POST", "/jobs", b'{"order": "' + b"x" * 5000 + b'"}')[0] == 413
    assert line.post(CHECK, Content_Type="text/plain")[0] == 415
    assert line.ask("POST", "/jobs?order=1", b"{}")[0] == 400
    for method, path in (("PUT", "/jobs"), ("DELETE", "/jobs/A-17"), ("POST", "/jobs/A-17")):
        assert line.ask(method, path)[0] == 405
    assert line.ask("GET", "/jobs")[0] == 405
    assert plans(location) == ()


def test_without_a_token_that_counts_nothing_is_told_or_kept(panel, line, location):
    secrets = ("", "rlt_" + "0" * 64, line.token[:-1], line.token + "0", line.token.upper())
    for number, secret in enumerate(secrets, start=2):
        stranger = LineComputer(panel.port, secret, f"127.0.0.{number}")
        status, said, headers = stranger.post(CHECK)
        assert (status, headers["www-authenticate"]) == (401, 'Bearer realm="robolink"')
        assert "line3" not in json.dumps(said)
        statuses = [stranger.get("A-17/3")[0] for _ in range(8)]
        assert set(statuses) == {401, 429}, "strangers may ask five times a second"
    assert line.post(CHECK, Authorization="Basic " + line.token)[0] == 401
    ended = LineComputer(panel.port, token_of("old", until="2026-11-29T00:00:00+00:00"))
    assert ended.post(CHECK)[:2] == (401, {"why": "This token has ended."})
    assert plans(location) == ()


def test_a_token_that_was_revoked_counts_no_more_at_once(line, location):
    assert line.post(CHECK)[0] == 201
    LineTokens().revoke("mes")
    assert line.post({**CHECK, "order": "A-18"})[0] == 401
    assert len(plans(location)) == 1


def test_a_token_orders_only_its_kinds_at_its_cells(panel, line, location):
    narrow = LineComputer(panel.port, token_of("plc", kinds=["check"], cells=["@line3"]))
    assert narrow.post({**CHECK, "kind": "backup"})[0] == 403
    for cell in ("line4-a", "nowhere", "LINE3-A", "line3"):
        assert narrow.post({**CHECK, "cell": cell})[0] == 403, cell
    assert plans(location) == ()
    assert narrow.post({**CHECK, "cell": "line3-b"})[0] == 201
    whys = [facts["why"] for kind, _, facts in panel.kept if kind == "refused"]
    assert whys == ["scope"] * 5


def test_a_browser_orders_nothing_even_with_a_token(panel, line, location):
    here = f"http://127.0.0.1:{panel.port}"
    for changed in (
        {"Origin": here},
        {"Origin": "https://evil.example"},
        {"Sec_Fetch_Site": "same-origin"},
        {"Host": "evil.example"},
        {"X_Forwarded_For": "127.0.0.1"},
    ):
        assert line.post(CHECK, **changed)[0] in (403, 421), changed
    assert line.ask("OPTIONS", "/jobs", Origin="https://evil.example")[0] == 403
    assert plans(location) == ()


@pytest.mark.soak
def test_no_answer_to_a_line_computer_is_a_tablet(line):
    _, _, headers = line.post(CHECK)
    assert "set-cookie" not in headers
    assert headers["connection"] == "close"
    assert headers["cache-control"] == "no-store"


@pytest.mark.soak
def test_the_token_stands_nowhere_on_disk(line, home):
    line.post(CHECK)
    secret = line.token.encode()
    folder = Path(os.environ["ROBOLINK_STATE_DIR"])
    held = [path for where in (home, folder) for path in where.rglob("*") if path.is_file()]
    held = [path for path in held if secret in path.read_bytes()]
    assert held == []


def test_too_many_requests_are_refused_and_those_of_others_are_not(panel, line, monkeypatch):
    monkeypatch.setattr(line_gate, "JOBS_A_SECOND", 2.0)
    statuses = [line.get("A-17/3")[0] for _ in range(10)]
    assert set(statuses) == {404, 429}
    assert LineComputer(panel.port, token_of("plc")).get("A-17/3")[0] == 404


def test_while_the_database_is_away_nothing_is_kept(line, location, request):
    assert line.post(CHECK)[0] == 201
    if "://" in location:
        server = request.getfixturevalue("server")
        server.stop()
    else:
        blocker = sqlite3.connect(location)
        blocker.execute("BEGIN IMMEDIATE")
    try:
        begun_s = time.monotonic()
        status, said, headers = line.post({**CHECK, "order": "A-18"})
        assert (status, headers["retry-after"]) == (503, "5")
        assert "Post the same order again" in said["why"]
        assert time.monotonic() - begun_s < 5
    finally:
        if "://" in location:
            server.start()
        else:
            blocker.close()
    assert line.get("A-18")[0] == 404
    assert line.post({**CHECK, "order": "A-18"})[0] == 201
    assert len(plans(location)) == 2


def processes_of(server):
    """Return the numbers of all processes of a server."""
    found = [server.process.pid]
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            if int(stat.read_text().rpartition(")")[2].split()[1]) == server.process.pid:
                found.append(int(stat.parent.name))
    return found


@pytest.mark.soak
@pytest.mark.parametrize("location", ["postgresql"], indirect=True)
def test_an_order_that_was_given_up_while_the_server_hung_is_not_kept_later(
    line, location, request
):
    """Its processes are frozen, so no time-out of theirs ends anything."""
    assert line.post(CHECK)[0] == 201
    server = request.getfixturevalue("server")
    frozen = processes_of(server)
    for pid in frozen:
        os.kill(pid, signal.SIGSTOP)
    try:
        assert line.post({**CHECK, "order": "A-18"})[0] == 503
    finally:
        for pid in frozen:
            os.kill(pid, signal.SIGCONT)
    for _ in range(50):
        status, _, _ = line.get("A-18")
        if status != 503:
            break
        time.sleep(0.1)
    assert status == 404
    assert [plan.name for plan in plans(location)] == ["A-17/3"]


def test_the_openapi_document_is_the_one_of_the_code_and_fits_what_is_answered(line):
    held = json.loads((Path(__file__).parents[3] / "docs" / "jobs.openapi.json").read_text())
    assert held == json.loads(json.dumps(jobs_openapi())), "python -m tools.jobs_openapi"
    text = json.dumps(held["components"]["schemas"])
    described = json.loads(text.replace("#/components/schemas/", "#/$defs/"))
    schemas = Schemas({"$defs": described})

    def wrong(name, document):
        return list(schemas.wrong(described[name], document))

    for said in (CHECK, OFFSET):
        assert said.keys() <= described["LineOrder"]["properties"].keys()
        status, answer, _ = line.post(said)
        assert status == 201
        assert wrong("LineJob", answer) == []
        assert answer.keys() == held["components"]["schemas"]["LineJob"]["properties"].keys()
    assert described["LineOrder"]["required"] == ["order", "cell", "kind"]
    for refused in (line.post({}), line.post(CHECK | {"kind": "drift"}), line.get("nothing")):
        assert wrong("Refused", refused[1]) == []
    assert wrong("Refused", {}) != []


@pytest.mark.soak
@pytest.mark.parametrize("location", ["postgresql"], indirect=True)
def test_a_home_takes_orders_with_the_rights_that_the_page_names(
    line, location, request, monkeypatch
):
    server = request.getfixturevalue("server")
    page = (Path(__file__).parents[3] / "docs" / "fleet.md").read_text()
    (homes,) = re.findall(r"```sql\n(.*?)```", page, re.DOTALL)
    (orders,) = re.findall(r"^    (GRANT INSERT .*;)$", page, re.MULTILINE)
    plans(location)  # its owner makes the tables
    database = location.rpartition("/")[2]
    server.execute("CREATE SCHEMA dbos", database)
    server.execute(homes, database)
    try:
        monkeypatch.setenv("ROBOLINK_PLANT", location.replace("journal@", "pc7@"))
        assert line.post(CHECK)[0] == 503
        server.execute(orders, database)
        assert line.post(CHECK)[0] == 201
        assert line.post(CHECK)[0] == 200
        assert len(plans(location)) == 1
    finally:
        server.execute("DROP OWNED BY pc7; DROP ROLE pc7", database)


def test_no_word_of_a_line_computer_reaches_a_terminal_or_a_page_unescaped(line, location):
    assert line.post({**CHECK, "order": "a\x1b[2Jb"})[0] == 422
    assert line.post({**CHECK, "order": "<b>'\"&"})[0] == 201
    assert line.get("<b>'\"&")[0] == 200
    assert plans(location)[0].name == "<b>'\"&"
    with FleetStore(location) as store:
        assert store.overviews()[0].counts == {JobState.WAITING: 1}
