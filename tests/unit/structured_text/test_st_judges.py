"""The interpreter gives the answers of two foreign compilers, and refuses where they differ."""

import json

import pytest
from robolink_simulators.structured_text import SourceText, StructuredProgram, StructuredTextError

from tests.unit.structured_text._bench import JUDGES, needs_judges, program

pytestmark = needs_judges


def as_value(of, written):
    if of == "LREAL":
        return float.fromhex(written)
    return bool(written) if of == "BOOL" else written


def answer(case):
    declared = [f"r : {case['result']};"]
    declared += [f"{name} : {of.replace('ARRAY', 'ARRAY ')};" for name, (of, *_) in variables(case)]
    made = program(case.get("body") or f"r := {case['expr']};", "\n".join(declared))
    for name, (of, *first) in variables(case):
        if first:
            made.put(name, as_value(of, *first))
    made.cycle(0)
    return made.value("r")


def variables(case):
    return case["vars"].items()


def test_every_case_has_the_answer_of_both_or_is_refused():
    cases = json.loads((JUDGES / "semantics.json").read_text())["cases"]
    wrong, refused = [], 0
    for case in cases:
        try:
            got = answer(case)
        except StructuredTextError:
            got = None
            refused += 1
        wanted = as_value(case["result"], case["value"]) if "value" in case else None
        if (type(got), got) != (type(wanted), wanted):
            wrong.append((case, got))
    assert wrong == []
    assert (len(cases), refused) == (259, 14)


def replayed(rows):
    source = SourceText("core.st", (JUDGES / "example" / "core.st").read_text())
    made = StructuredProgram([source], "Main")
    wrong = []
    for row, (ms, permit, inbox, outbox) in enumerate(rows):
        made.put("permit", bool(permit))
        made.put("inbox", [int(inbox[at : at + 4], 16) for at in range(0, 64, 4)])
        made.cycle(ms * 1000)
        if "".join(f"{word:04x}" for word in made.value("outbox")) != outbox:
            wrong.append(row)
    return wrong


def core_rows():
    return json.loads((JUDGES / "example" / "core_trace.json").read_text())["rows"]


def test_the_worked_example_gives_the_recorded_words():
    assert replayed(core_rows()[:150]) == []


@pytest.mark.soak
def test_the_worked_example_gives_every_recorded_word():
    assert len(core_rows()) == 1000
    assert replayed(core_rows()) == []


def timers(text):
    return StructuredProgram([SourceText("timers.st", text)], "Main")


def test_timers_and_counters_run_as_recorded_and_those_that_differ_are_refused():
    text = (JUDGES / "example" / "timers.st").read_text()
    with pytest.raises(StructuredTextError, match=r"timers\.st, line 13, .* F_TRIG"):
        timers(text)
    agreed = [line for line in text.splitlines() if "fFall" not in line and "fDown" not in line]
    made = timers("\n".join(agreed))
    trace = json.loads((JUDGES / "example" / "timers_trace.json").read_text())
    for ms, inp, clear, outputs, _ in trace["rows"]:
        made.put("inp", bool(inp))
        made.put("clear", bool(clear))
        made.cycle(ms * 1000)
        got = [*map(int, made.value("outs")), made.value("cntUp"), 0]
        named = zip(trace["outputs"], got, outputs, strict=True)
        assert [row for row in named if row[1] != row[2] and not differs(row[0])] == [], ms


def differs(name):
    return name.startswith(("f_trig", "ctd"))
