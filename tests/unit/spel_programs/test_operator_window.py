"""Input from the window: a person answers, or a script did before (docs/reference/spel.md 17)."""

ASKING = "\n".join(
    [
        "Function main",
        "Real a, b",
        "String s$",
        "Input a",
        "Input b, s$",
        "Print a, b, s$",
        "Line Input s$",
        'Print #21, s$, "!"',
        "Fend",
    ]
)


def test_lines_are_taken_in_their_order_and_asked_for_with_a_mark(cell):
    made = cell(ASKING)
    made.runner.channels.window.type("25.1x", "-10000, text", "A, B, C")
    assert made.run() == ["??25.1 -10000text", "?A, B, C!"]


def test_a_task_waits_until_somebody_types_and_others_go_on(cell):
    made = cell(ASKING + "\nFunction main1\nXqt main\nWait 30\nPrint Tmr(0) > 29\nFend")
    made.runner.start("main1", 0)
    made.simulator.advance(40_000_000_000)
    assert "".join(made.runner.console) == "?-1\r\n"
    assert len(made.runner.tasks) == 1
    made.runner.channels.window.type("1", "2 b", "c")
    made.simulator.advance(41_000_000_000)
    assert not made.runner.tasks
    assert "".join(made.runner.console).endswith("c!\r\n")


def test_wrong_numbers_of_data_and_silence_are_one_error(cell):
    made = cell(ASKING)
    made.runner.channels.window.type("1", "2")
    made.run()
    assert made.runner.failure.number == 2505
    made = cell(ASKING)
    made.runner.channels.window.ask = lambda: None
    made.run()
    assert made.runner.failure.number == 2505


def test_a_blank_separates_variables_and_belongs_to_the_last_text(cell):
    asking = "Function main\nString s$, t$\nInteger n\nInput s$\nInput n, t$\nPrint s$, n, t$\nFend"
    made = cell(asking)
    made.runner.channels.window.type("reach 100 450 600", "7 two words")
    assert made.run() == ["??reach 100 450 600 7two words"]
    made = cell(asking, input_blank="everywhere")
    made.runner.channels.window.type("reach 100 450 600")
    made.run()
    assert made.runner.failure.number == 2505
