"""What the script of a page sends, and when; what it shows where nothing is heard."""

import time
from dataclasses import replace

import pytest
from robolink_cli.wizard.views.records import ListRow, QuestionView, Weight

from tests.panel.browser import samples
from tests.panel.browser.fingers import Fingers
from tests.panel.browser.scripted import until

TAKE = "[data-action=take]"
X_PLUS = '[data-action=jog][data-hold="x+"]'


def touch(number=7, **more):
    """Return a view on which everything can be pressed."""
    view = samples.views("en")["touch"]
    actions = tuple(replace(one, why_not="") for one in view.actions)
    return replace(view, number=number, actions=actions, **more)


@pytest.fixture
def page(panel, tablet):
    """The cell's page, alive."""
    panel.view = touch()
    page = tablet.new_page()
    page.goto(panel.url)
    alive(page)
    return page


@pytest.fixture
def fingers(page):
    return Fingers(page)


def alive(page):
    page.wait_for_selector("body:not(.silent)")


def still(panel, kind="press", for_s=0.5):
    """Return the frames of a kind after a while in which they would have come."""
    time.sleep(for_s)
    return panel.of(kind)


# A press.


def test_a_press_carries_the_number_its_action_and_an_id(panel, page, fingers):
    fingers.tap(TAKE)
    until(lambda: panel.of("press"))
    (press,) = panel.of("press")
    assert (press["number"], press["action"], press["value"]) == (7, "take", "")
    assert len(press["press"]) == 24


def test_a_press_goes_to_the_question_on_which_the_finger_went_down(panel, page, fingers):
    """20 of 20: the question changes under the finger, and another button stands there then."""
    other = samples.views("en")["values"]
    for time_ in range(20):
        number = 100 + 2 * time_
        panel.show(touch(number))
        page.wait_for_selector(TAKE)
        page.wait_for_selector("body[data-screen=touch]")
        before = len(panel.of("press"))
        fingers.down(TAKE)
        panel.show(replace(other, number=number + 1))
        page.wait_for_selector("[data-action=write]")
        fingers.up()
        until(lambda before=before: len(panel.of("press")) > before)
    presses = panel.of("press")
    wrong = [one for one in presses if one["action"] != "take" or one["number"] % 2]
    assert (len(presses), wrong) == (20, [])


def test_a_part_that_is_drawn_anew_under_the_finger_takes_nothing_away(panel, page, fingers):
    fingers.down(TAKE)
    panel.show(touch(message="Z -112.193"))
    page.wait_for_selector("text=Z -112.193")
    fingers.up()
    until(lambda: panel.of("press"))
    assert panel.of("press")[0]["action"] == "take"


def test_a_finger_that_slides_off_presses_nothing(panel, page, fingers):
    x, y = fingers.down(TAKE)
    fingers.move(x, y - 300)
    fingers.move(x, y)
    fingers.up()
    assert still(panel) == []


def test_a_finger_that_slides_over_a_page_leads_nowhere(panel, page, fingers):
    """A browser takes it for Back where it may."""
    panel.documents["/before"] = "<!DOCTYPE html><title>before</title>"
    page.goto(panel.url.replace("/cell/line3", "/before"))
    page.goto(panel.url)
    alive(page)
    for y in (60, 400, 760):
        for start, end in ((200, 1200), (1200, 200), (640, 1270)):
            fingers.down((start, y))
            for step in range(1, 9):
                fingers.move(start + (end - start) * step / 8, y)
            fingers.up()
    time.sleep(1.0)
    assert page.url == panel.url
    assert still(panel) == []


def test_two_fingers_press_nothing(panel, page, fingers):
    fingers.down(TAKE)
    fingers.down("[data-action=leave]", 1)
    fingers.up(1)
    fingers.up()
    assert still(panel) == []


def test_what_is_off_cannot_be_pressed(panel, page, fingers):
    panel.show(samples.views("en")["touch"])
    page.wait_for_selector(f"{TAKE}[aria-disabled=true]")
    fingers.tap(TAKE)
    assert still(panel) == []


def test_who_only_watches_presses_nothing(panel, page, fingers):
    panel.watcher = replace(panel.watcher, seat="Wang")
    panel.show(touch())
    page.wait_for_selector(f"{X_PLUS}[aria-disabled=true]")
    fingers.tap(X_PLUS)
    assert page.locator(TAKE).count() == 0
    assert still(panel) == []


def test_a_double_press_sends_two_for_the_same_question(panel, page, fingers):
    """The job takes the first: the second has an old number by then, or is too early."""
    fingers.tap(TAKE)
    fingers.tap(TAKE)
    until(lambda: len(panel.of("press")) == 2)
    first, second = panel.of("press")
    assert first["number"] == second["number"]
    assert first["press"] != second["press"]


def test_the_keys_of_a_keyboard_press_too(panel, page):
    page.focus(TAKE)
    page.keyboard.press("Enter")
    page.keyboard.press("Space")
    until(lambda: len(panel.of("press")) == 2)
    assert {one["action"] for one in panel.of("press")} == {"take"}


def test_nothing_is_sent_for_later_while_nobody_is_there(panel, page, fingers):
    place = fingers.middle(TAKE)
    panel.kill()
    fingers.tap(place)
    time.sleep(0.3)
    panel.start()
    alive(page)
    assert still(panel) == []


# What is typed.


def test_digits_are_typed_on_the_screen_and_go_with_the_press(panel, page, fingers):
    panel.show(samples.views("en")["values"])
    page.wait_for_selector("[data-typed=tool]")
    for key in ("1", "2", "back"):
        fingers.tap(f'[data-key="{key}"]')
    fingers.tap("[data-action=write]")
    until(lambda: panel.of("press"))
    assert panel.of("press")[0]["value"] == "1"


def test_what_was_typed_stays_with_its_question_and_no_longer(panel, page, fingers):
    values = samples.views("en")["values"]
    panel.show(values)
    page.wait_for_selector("[data-typed=tool]")
    fingers.tap('[data-key="1"]')
    told = replace(values, body=replace(values.body, taught=("Told meanwhile.",)))
    panel.show(told)
    page.wait_for_selector("text=Told meanwhile.")
    assert page.input_value("[data-typed=tool]") == "1"
    panel.show(replace(told, number=values.number + 1))
    until(lambda: page.input_value("[data-typed=tool]") == "")


def test_a_scanner_types_and_enter_answers(panel, page):
    panel.show(samples.views("en")["question"])
    page.focus("[data-typed=text]")
    page.keyboard.type("N-0816")
    page.keyboard.press("Enter")
    until(lambda: panel.of("press"))
    assert [(one["action"], one["value"]) for one in panel.of("press")] == [("answer", "N-0816")]


def test_a_list_that_is_too_long_says_so_and_can_be_read_to_its_end(panel, page, fingers):
    view = samples.views("en")["choice"]
    rows = tuple(ListRow(f"Job {n}", str(n), ("what it does",)) for n in range(20))
    panel.show(replace(view, body=replace(view.body, rows=rows)))
    for _ in range(4):
        page.wait_for_selector("#more:visible")
        if "top" in page.inner_text("#more"):
            break
        fingers.tap("#more")
        time.sleep(0.3)
    assert "top" in page.inner_text("#more")
    assert page.locator("text=Job 19").bounding_box()["y"] < 700
    assert still(panel) == []


def test_what_comes_from_a_record_is_text_and_never_markup(panel, page):
    evil = '<img src=x onerror="document.title=1"><script>document.title=1</script>"\'&'
    view = touch()
    panel.show(
        replace(
            view, message=evil, heard=(evil,), head=replace(view.head, title=evil),
            actions=(replace(view.actions[0], label=evil, value=evil),),
            body=QuestionView((evil,), evil, text=False),
        )
    )  # fmt: skip
    page.wait_for_selector("text=onerror")
    assert page.locator("main img, footer img, header img").count() == 0
    assert page.get_attribute("[data-action=leave]", "data-value") == evil
    assert page.title() != "1"


# A held key.


def hold(panel, fingers, where=X_PLUS):
    """Hold a key until beats come."""
    at = fingers.down(where)
    until(lambda: len(panel.of("beat")) >= 3)
    return at


def has_ended(panel, within_s=0.35):
    """Return whether the last held key has ended: released, or no beat comes any more."""
    time.sleep(within_s)
    count = len(panel.of("beat"))
    time.sleep(0.5)
    return len(panel.of("beat")) == count


def test_a_short_press_of_a_key_is_one_step(panel, page, fingers):
    fingers.tap(X_PLUS)
    until(lambda: panel.of("press"))
    assert panel.of("press")[0]["value"] == "x+0.1"
    assert still(panel, "hold") == []


def test_a_held_key_beats_under_one_finger_and_ends_with_it(panel, page, fingers):
    hold(panel, fingers)
    (begun,) = panel.of("hold")
    assert (begun["axis"], begun["number"]) == ("x+", 7)
    fingers.up()
    at_s = time.monotonic()
    until(lambda: panel.of("release"))
    assert panel.last_s("release") - at_s < 0.25
    assert {one["finger"] for one in panel.of("beat")} == {begun["finger"]}
    assert has_ended(panel)
    assert still(panel) == []  # it was no tap


def test_each_finger_that_goes_down_has_another_id(panel, page, fingers):
    for _ in range(3):
        hold(panel, fingers)
        fingers.up()
        panel.frames = [(s, f) for s, f in panel.frames if f["t"] != "beat"]
    assert len({one["finger"] for one in panel.of("hold")}) == 3


def test_a_held_key_goes_on_while_its_part_is_drawn_anew(panel, page, fingers):
    hold(panel, fingers)
    for way in range(5):
        panel.show(touch(message=f"step {way}"))
        page.wait_for_selector(f"text=step {way}")
    count = len(panel.of("beat"))
    until(lambda: len(panel.of("beat")) > count + 2)
    fingers.up()
    until(lambda: panel.of("release"))


def test_a_held_key_ends_with_its_question(panel, page, fingers):
    hold(panel, fingers)
    panel.show(touch(8))
    until(lambda: panel.of("release"))
    assert has_ended(panel)


def test_a_held_key_ends_where_the_finger_slides_off(panel, page, fingers):
    x, y = hold(panel, fingers)
    fingers.move(x + 500, y)
    until(lambda: panel.of("release"))
    fingers.move(x, y)
    assert has_ended(panel)


def test_a_held_key_ends_with_a_second_finger(panel, page, fingers):
    hold(panel, fingers)
    fingers.down("[data-action=leave]", 1)
    until(lambda: panel.of("release"))
    fingers.up(1)
    assert has_ended(panel)


def test_a_held_key_ends_with_stop(panel, page, fingers):
    hold(panel, fingers)
    fingers.down("#stop", 1)
    until(lambda: panel.of("release") and panel.of("stop"))
    assert has_ended(panel)


def test_a_held_key_ends_where_the_page_was_stuck(panel, page, fingers):
    """Beats would begin again by themselves, whether the finger is still there or not."""
    hold(panel, fingers)
    page.evaluate("const end = performance.now() + 1200; while (performance.now() < end);")
    assert has_ended(panel)


def test_a_held_key_ends_with_a_question_of_the_browser(panel, page, fingers):
    hold(panel, fingers)

    def answer(dialog):
        time.sleep(1.2)
        dialog.accept()

    page.on("dialog", answer)
    page.evaluate("alert('?')")
    assert has_ended(panel)


def test_a_held_key_ends_with_a_reload(panel, page, fingers):
    hold(panel, fingers)
    page.reload()
    until(lambda: panel.of("release"))
    assert has_ended(panel)


def test_a_held_key_ends_where_another_tab_comes_to_the_front(panel, page, fingers):
    page.context.new_cdp_session(page).send(
        "Emulation.setFocusEmulationEnabled", {"enabled": False}
    )
    hold(panel, fingers)
    other = page.context.new_page()
    other.bring_to_front()
    assert has_ended(panel)


@pytest.mark.parametrize("happening", ["blur", "pagehide", "pointercancel", "visibilitychange"])
def test_a_held_key_ends_with_what_a_browser_says(panel, page, fingers, happening):
    target = "document" if happening in ("pointercancel", "visibilitychange") else "window"
    hold(panel, fingers)
    page.evaluate(f"{target}.dispatchEvent(new Event('{happening}'))")
    until(lambda: panel.of("release"))
    assert has_ended(panel)


def test_a_held_key_ends_where_nothing_is_heard(panel, page, fingers):
    hold(panel, fingers)
    panel.frozen = True
    until(lambda: panel.of("release"), 5)
    assert has_ended(panel)


def test_a_large_step_is_never_repeated(panel, page, fingers):
    panel.show(touch(body=replace(touch().body, pad=samples.pad(1.0))))
    page.wait_for_selector('[data-value="x+1"]')
    assert page.locator("[data-hold]").count() == 0
    fingers.down('[data-value="x+1"]')
    time.sleep(0.8)
    fingers.up()
    until(lambda: panel.of("press"))
    assert still(panel, "hold") == []
    assert panel.of("press")[0]["value"] == "x+1"


# Silence.


def test_what_is_old_is_grey_and_only_stop_can_be_pressed(panel, page, fingers):
    panel.frozen = True
    at_s = time.monotonic()
    page.wait_for_selector("body.silent")
    assert 0.7 < time.monotonic() - at_s < 2.5
    assert page.is_visible("#lost")
    place = fingers.middle(TAKE)
    fingers.tap(place)
    fingers.tap("a.home")
    fingers.tap("#stop")
    until(lambda: panel.of("stop") and panel.posts)
    page.wait_for_selector("#unstopped:visible")
    assert still(panel) == []
    assert page.url == panel.url
    panel.frozen = False
    alive(page)
    assert page.is_hidden("#lost")


def test_a_stream_that_is_silent_is_made_anew_each_second(panel, page):
    panel.frozen = True
    page.wait_for_selector("text=/attempt [3-9]$/")
    panel.frozen = False
    alive(page)


def test_a_server_that_was_killed_and_started_again_is_found(panel, page, fingers):
    page.evaluate("window.same = true")
    panel.kill()
    page.wait_for_selector("body.silent")
    panel.server, panel.view = "two", touch(31)
    panel.start()
    at_s = time.monotonic()
    alive(page)
    assert time.monotonic() - at_s < 4
    fingers.tap(TAKE)
    until(lambda: panel.of("press"))
    assert panel.of("press")[0]["number"] == 31
    assert page.evaluate("window.same")


def test_a_server_with_other_files_has_the_page_loaded_anew(panel, page):
    page.evaluate("window.same = true")
    panel.kill()
    panel.server, panel.pages.version = "two", "other0000000"
    panel.start()
    page.wait_for_event("load")
    alive(page)


def test_a_reload_in_the_middle_shows_the_same(panel, page, fingers):
    panel.show(touch(message="Recorded."))
    page.wait_for_selector("text=Recorded.")
    page.reload()
    alive(page)
    assert page.is_visible("text=Recorded.")
    fingers.tap(TAKE)
    until(lambda: panel.of("press"))


def test_the_age_of_a_reading_is_shown_and_grows(panel, page):
    panel.age_ms = 200
    page.wait_for_selector("text=/read 0.[234] s ago/")
    panel.age_ms = 4200
    page.wait_for_selector("text=/read 4.. s ago/")


# Sleep.


def test_the_first_touch_after_a_rest_only_wakes(panel, page, fingers):
    page.evaluate("document.dispatchEvent(new Event('visibilitychange'))")
    alive(page)
    assert page.is_visible("#asleep")
    fingers.tap(TAKE)
    fingers.tap(TAKE)
    assert still(panel, for_s=0.8) == []
    assert page.is_hidden("#asleep")
    fingers.tap(TAKE)
    until(lambda: panel.of("press"))


def test_a_minute_without_a_touch_is_a_rest(panel, tablet):
    panel.view = touch()
    page = tablet.new_page()
    page.clock.install()
    page.goto(panel.url)
    page.clock.run_for(1000)
    page.clock.run_for(61_000)
    page.wait_for_selector("#asleep:visible")


def test_stop_needs_no_waking(panel, page, fingers):
    page.evaluate("document.dispatchEvent(new Event('visibilitychange'))")
    fingers.tap("#stop")
    until(lambda: panel.of("stop") or panel.posts)
    page.wait_for_selector("#stopped:visible")


# STOP.


def test_stop_goes_both_ways_at_finger_down_under_one_id(panel, page, fingers):
    fingers.down("#stop")
    until(lambda: panel.of("stop") and panel.posts)
    (by_stream,), ((_, path, by_post),) = panel.of("stop"), panel.posts
    assert path == "/stop"
    assert by_post["cell"] == "line3"
    assert by_stream["press"] == by_post["press"]
    assert max(by_stream["age_ms"], by_post["age_ms"]) < 100
    page.wait_for_selector("#stopped:visible")
    assert "STOPPED" in page.inner_text("#stopped")
    assert "line3 is at rest." in page.inner_text("#stopped")
    fingers.up()
    assert page.is_hidden("#unstopped")


def test_a_stop_that_nothing_confirms_shouts_within_half_a_second(panel, page, fingers):
    panel.answers = None
    at_s = time.monotonic()
    fingers.tap("#stop")
    page.wait_for_selector("#unstopped:visible")
    assert 0.4 < time.monotonic() - at_s < 1.5
    assert "emergency stop button" in page.inner_text("#unstopped")
    # It is said again under the same id, until something answers.
    until(lambda: len(panel.of("stop")) >= 3)
    assert len({one["press"] for one in panel.of("stop")}) == 1
    assert panel.of("stop")[2]["age_ms"] > 500
    panel.answers = "stopped"
    page.wait_for_selector("#stopped:visible")
    assert page.is_hidden("#unstopped")


def test_a_stop_is_not_said_for_ever(panel, page, fingers):
    panel.answers = None
    fingers.tap("#stop")
    time.sleep(6.5)
    assert max(one["age_ms"] for one in panel.of("stop")) < 5000
    count = len(panel.of("stop"))
    assert len(still(panel, "stop", 1.0)) == count


CLOSINGS = """(id) => {
  const seen = document.getElementById(id);
  window.closings = 0;
  const count = () => { closings += seen.hidden; };
  new MutationObserver(count).observe(seen, {attributeFilter: ["hidden"]});
}"""


def test_who_presses_where_it_says_not_stopped_presses_stop(panel, page, fingers):
    panel.answers = "failed"
    fingers.tap("#stop")
    page.wait_for_selector("#unstopped:visible")
    fingers.tap("#unstopped .huge")
    until(lambda: len({one["press"] for one in panel.of("stop")}) == 2)
    assert page.is_visible("#unstopped")
    # A STOP is repeated until it succeeds, and each answer that it failed shows this again.
    page.evaluate(CLOSINGS, "unstopped")
    fingers.tap("#unstopped [data-close]")
    page.wait_for_function("closings === 1")
    assert len({one["press"] for one in panel.of("stop")}) == 2


@pytest.mark.parametrize("outcome", ["failed", "old"])
def test_a_stop_that_failed_is_not_called_stopped(panel, page, fingers, outcome):
    panel.answers = outcome
    fingers.tap("#stop")
    page.wait_for_selector("#unstopped:visible")
    assert page.is_hidden("#stopped")


def test_stop_with_nothing_to_stop_says_so(panel, page, fingers):
    panel.answers = "nothing"
    fingers.tap("#stop")
    page.wait_for_selector("#stopped:visible")
    assert "NOTHING TO STOP" in page.inner_text("#stopped")


def test_each_press_of_stop_has_another_id(panel, page, fingers):
    for count in (1, 2, 3):
        fingers.tap("#stop")
        until(lambda count=count: len({one["press"] for one in panel.of("stop")}) == count)


def test_stop_is_never_replaced_and_works_with_a_keyboard(panel, page):
    page.evaluate("document.getElementById('stop').same = true")
    panel.show(samples.views("en")["end"])
    page.wait_for_selector("text=DONE")
    assert page.evaluate("document.getElementById('stop').same")
    page.focus("#stop")
    page.keyboard.press("Space")
    until(lambda: panel.of("stop"))


def test_stop_works_while_a_stream_is_dead(panel, page, fingers):
    """The way of the post alone is left."""
    page.evaluate("WebSocket.prototype.send = () => {}")
    fingers.tap("#stop")
    until(lambda: panel.posts)
    page.wait_for_selector("#stopped:visible")
    assert panel.of("stop") == []


def test_six_tabs_of_one_browser_stop_as_fast_as_one(panel, tablet):
    pages = []
    for _ in range(6):
        page = tablet.new_page()
        page.goto(panel.url)
        alive(page)
        pages.append(page)
    for page in pages:
        page.bring_to_front()
        count, at_s = len(panel.of("stop")), time.monotonic()
        Fingers(page).tap("#stop")
        until(lambda count=count: len(panel.of("stop")) > count)
        assert panel.last_s("stop") - at_s < 0.5
        page.wait_for_selector("#stopped:visible")


def test_what_is_refused_is_told(panel, page, fingers):
    panel.watcher = replace(panel.watcher, seat="Wang")
    panel.show(touch())
    fingers.tap('[data-post="/seat"]')
    page.wait_for_selector("#note:visible")
    assert "Not here." in page.inner_text("#note")
    ((_, path, body),) = panel.posts
    assert (path, body) == ("/seat", {"cell": "line3"})


def test_the_weights_say_where_a_button_stands(panel, page):
    """What ends the job is at the left, far from the main action."""
    boxes = [one.bounding_box()["x"] for one in page.locator("footer .b").all()]
    assert boxes == sorted(boxes)
    classes = [one.get_attribute("class") for one in page.locator("footer .b").all()]
    assert Weight.LEAVES in classes[0]
    assert Weight.MAIN in classes[-1]
