"""The face that a Windows console gets, and the full screen with keys of wine's console."""

import re

import pytest


def test_the_full_screen_is_drawn_takes_keys_and_is_left(opened):
    console = opened("calls", "change", "needle.toml")
    console.see("Scan the id of the new needle.")
    console.see("READY   motors on   power LOW   tool 1 selected   reading")
    console.see(r"\A *line3   Change needle .*\n.*\n-{80} *\n(.*\n)+-{80} *\n")
    console.see(r"\n\[Enter\] Done +\[Esc\] STOP *\n")
    assert sum(row.startswith("-") for row in console.text.split("\n")) == 2
    console.rest(0.5)
    console.type("N-7")
    console.see("> N-7_")
    console.type("\r")
    console.see(r"Start moving \(2 open\)")
    assert console.text.count("\n OK ") == 5
    console.rest(0.6)
    console.type("2")
    console.type("5")
    console.see(r"Start moving \(1 open\)")
    assert len(re.findall(r"\n[ >]OK ", console.text)) == 6
    console.rest(0.6)
    console.type("0")
    console.see("Nothing moved. Nothing was written. Tool 1 is selected.")
    assert console.exit_code() == 9


@pytest.mark.parametrize(
    "how", [{"columns": 80}, {"redirected": "> result.txt"}], ids=["80 columns", "stdout in a file"]
)
def test_a_console_that_takes_no_full_screen_gets_the_dialogue_of_lines_at_once(opened, how):
    console = opened("calls", "change", "needle.toml", **how)
    console.see("scan it, then Enter. To end:")
    assert not [row for row in console.screen.display if "STOP" in row or row.startswith("---")]
    console.type("stop\r")
    assert console.exit_code() == 9


@pytest.mark.parametrize("redirected", ["< NUL", "2> NUL"])
def test_nul_is_no_terminal_though_windows_says_so(opened, redirected):
    console = opened("calls", "change", "needle.toml", redirected=redirected)
    assert console.exit_code() == 9
    assert "-----" not in console.text


@pytest.mark.parametrize("way", ["calls", "sequences"])
def test_f2_changes_the_language_where_the_job_is_chosen(opened, way):
    console = opened(way, "change")
    console.see(r"1 of 7  Choose")
    console.see(r"\[F2\] Chinese")
    console.rest(0.6)
    console.send("f2")
    console.see(r"1/7")
    console.see(r"\[F2\] English")
    console.rest(0.6)
    console.send("f2")
    console.see(r"Which job\?")
    console.rest(0.6)
    console.send("0")
    assert console.exit_code() == 9
