"""--order: what is delivered again, and what is refused then."""

import json

import pytest

from robolink.journal import open_journal
from robolink.model import EntryKind, ToolOffset

SET = ("tool", "set", "1", "--x", "12.5", "--order", "A-17", "--yes")
NEW = ToolOffset(12.5, -3.5, -20.0)


@pytest.mark.fault("F79")
def test_f79_an_order_delivered_again_reports_the_first_result_and_writes_nothing(run, simulator):
    code, out, err = run(*SET, "--json")
    assert code == 0, err
    first = json.loads(out)
    assert (first["order"], first["already_done"]) == ("A-17", False)
    written, entries = simulator.machine.flash_writes, open_journal().count()
    code, out, _ = run(*SET, "--json")
    assert (code, json.loads(out)) == (0, {**first, "already_done": True})
    assert first["read_back"]["x_mm"] == 12.5
    assert "nothing was moved or written now" in run(*SET)[1]
    assert (simulator.machine.flash_writes, open_journal().count()) == (written, entries)


@pytest.mark.fault("F79")
@pytest.mark.parametrize(
    ("between", "code", "said"),
    [
        (("undo", "--yes"), 2, "What order A-17 did was taken back"),
        (("tool", "set", "1", "--x", "13", "--yes"), 5, "it holds X 13.000"),
    ],
)
def test_f79_an_order_that_does_not_stand_any_more_is_refused_by_name(
    run, simulator, between, code, said
):
    assert run(*SET)[0] == 0
    assert run(*between)[0] == 0
    held, written = simulator.machine.tools.get(1), simulator.machine.flash_writes
    refused, _, err = run(*SET)
    assert refused == code
    assert said in " ".join(err.split())
    assert "Give a new order" in " ".join(err.split())
    assert (simulator.machine.tools.get(1), simulator.machine.flash_writes) == (held, written)
    assert run("tool", "set", "1", "--x", "12.5", "--order", "A-18", "--yes")[0] == 0
    assert simulator.machine.tools.get(1) == NEW


@pytest.mark.fault("F79")
def test_f79_one_order_for_two_jobs_is_refused(run, simulator):
    assert run(*SET)[0] == 0
    code, _, err = run("tool", "set", "1", "--x", "12.6", "--order", "A-17", "--yes")
    assert (code, "for another job" in err) == (2, True)
    assert simulator.machine.tools.get(1) == NEW


@pytest.mark.fault("F79")
@pytest.mark.parametrize("order", ["", "x" * 65, "Zw\xf6lf", "a\nb"])
def test_f79_an_order_is_some_printable_characters(run, simulator, order):
    code, _, err = run("tool", "set", "1", "--x", "12.5", "--order", order, "--yes")
    assert (code, "not the id of an order" in err) == (2, True)
    assert simulator.machine.flash_writes == 0


@pytest.mark.fault("F79")
def test_f79_a_dry_run_carries_out_no_order(run, simulator):
    for words in ((*SET[:-1],), ("calibrate", "two-pose", "--tool", "1", "--order", "A-17")):
        code, _, err = run(*words, "--dry-run")
        assert (code, "A dry run carries out no order" in err) == (2, True)
    assert not list(open_journal().entries(kinds=(EntryKind.ORDER,)))
