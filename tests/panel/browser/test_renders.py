"""Every screen, drawn: nothing is cut, nothing is too small for a glove, STOP is always free."""

import time
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_cli.panel.pages import Pages, Watcher

from tests.panel.browser import plan_samples, samples
from tests.panel.browser.conftest import SIZES
from tests.panel.browser.person import pictured
from tests.panel.browser.scripted import OPERATOR

pytestmark = pytest.mark.timeout(240)

PAGES = ("idle", "busy", "overview", "history", "login", "pairing", *plan_samples.LONG)

LEAST = {"1280": 86, "1024": 67}
"""Smallest side of what is pressed, in px: 15 mm on a tablet of 10.1 inch, less the frame."""

FAULTS = """(least) => {
  const faults = [], text = (one) => one.textContent.trim().replace(/\\s+/g, ' ').slice(0, 60);
  const fault = (what, one, ...sizes) => faults.push([what, text(one), ...sizes]);
  for (const one of document.querySelectorAll('header *, main *, footer *, #stop')) {
    const box = one.getBoundingClientRect();
    if (!box.width || one.closest('svg, .unseen, .steps')) continue;
    if (box.right > innerWidth + 1 || box.left < -1) fault('beyond the edge', one);
    if (one.matches('button, a, input:not([type=hidden])')) {
      const enough = one.matches('input') ? least * 0.6 : least;
      if (Math.min(box.width, box.height) < enough) fault('small', one, box.width, box.height);
    }
    const high = one.matches('.b, #stop, h1, .facts') && one.scrollHeight > one.clientHeight + 2;
    const isText = one.matches('.b, #stop, td, th, h1, .facts, .card p');
    const wide = isText && one.scrollWidth > one.clientWidth + 1;
    if (high || wide) fault('cut', one, one.scrollWidth, one.clientWidth, one.scrollHeight);
  }
  const main = document.getElementById('main');
  if (main.scrollHeight > main.clientHeight + 1 && main.dataset.long === undefined)
    faults.push(['does not fit', main.scrollHeight, main.clientHeight]);
  return faults;
}"""

STOP_IS_FREE = """() => {
  const box = document.getElementById('stop').getBoundingClientRect();
  const places = [[.5, .5], [.08, .1], [.92, .1], [.08, .9], [.92, .9]];
  const {left, top, width, height} = box;
  const at = (x, y) => document.elementFromPoint(left + x * width, top + y * height);
  return box.right > innerWidth - 2 && box.top < 2 &&
    places.every(([x, y]) => at(x, y)?.closest('#stop'));
}"""


def documents(language, dark):
    """Return whole pages by their paths."""
    pages = Pages()
    watcher = Watcher(language, dark, "here", "Chen", "operator")
    card = samples.CELLS[0]
    return {
        "/idle": pages.page("cell", watcher, cell="line3", parts=pages.idle(card, watcher)),
        "/busy": pages.page(
            "cell", watcher, cell="line3", parts=pages.idle(replace(card, busy=True), watcher)
        ),
        "/overview": pages.page("overview", watcher, cells=samples.CELLS),
        "/history": pages.page(
            "history", watcher, cell="line3", changes=samples.CHANGES, charts=samples.charts()
        ),
        "/login": pages.page("login", watcher, names=("Chen", "Wang", "Li", "Meier")),
        "/pairing": pages.page(
            "pairing", Watcher(language, dark, paired=False), names=("Meier",)
        ),
        **plan_samples.documents(pages, replace(watcher, role="engineer")),
    }  # fmt: skip


@pytest.fixture(params=[f"{size}-{language}" for size in SIZES for language in ("en", "zh")])
def screen(request, panel, chromium):
    """A tablet of one size and language."""
    size, language = request.param.split("-")
    context = chromium.new_context(
        viewport=dict(zip(("width", "height"), SIZES[size], strict=True)), has_touch=True
    )
    page = context.new_page()
    page.on("console", lambda said: pytest.fail(said.text) if said.type == "error" else None)
    panel.watcher = replace(OPERATOR, language=language)
    panel.documents = documents(language, dark=False)
    yield size, language, page
    context.close()


def test_nothing_is_cut_small_or_over_stop(panel, screen):
    size, language, page = screen
    faults = {}
    for name, view in samples.views(language).items():
        panel.view = view
        page.goto(panel.url)
        page.wait_for_selector("body:not(.silent)")
        faults[name] = look(page, size)
        pictured(page, f"{name}-{size}-{language}")
    panel.beats_only = True  # what is measured are these pages, not the view that follows
    for name in PAGES:
        page.goto(panel.url.replace("/cell/line3", f"/{name}"))
        if name in ("history", *plan_samples.LONG):
            page.evaluate("document.getElementById('main').dataset.long = ''")
        faults[name] = look(page, size)
        page.evaluate("document.body.classList.remove('silent')")
        pictured(page, f"{name}-{size}-{language}")
    assert {name: found for name, found in faults.items() if found} == {}


def look(page, size):
    found = page.evaluate(FAULTS, LEAST[size])
    return found if page.evaluate(STOP_IS_FREE) else [*found, "STOP is covered"]


def test_what_lies_over_a_page_leaves_stop_free(panel, screen):
    _, _, page = screen
    page.goto(panel.url)
    page.wait_for_selector("body:not(.silent)")
    panel.frozen = True
    page.wait_for_selector("#lost:visible")
    for over in ("unstopped", "stopped", "note", "asleep"):
        page.evaluate(f"document.getElementById('{over}').hidden = false")
    assert page.evaluate(STOP_IS_FREE)
    found = page.evaluate(
        """() => [...document.querySelectorAll('.over')].filter((one) => {
             const {left, right, top, bottom} = one.getBoundingClientRect();
             return left < 0 || right > innerWidth || top < 0 || bottom > innerHeight;
           }).map((one) => one.id)"""
    )
    assert found == []


def test_axe_finds_no_fault(panel, chromium):
    """Bright and dark, in full and grey: names, roles, contrast."""
    axe = Path(pytest.importorskip("axe_playwright_python").__file__).with_name("axe.min.js")
    source = axe.read_text(encoding="utf-8")
    faults = {}
    for dark in (False, True):
        context = chromium.new_context(viewport={"width": 1280, "height": 800})
        page = context.new_page()
        panel.watcher = replace(OPERATOR, dark=dark)
        panel.documents = documents("en", dark)
        for name, view in samples.views("en").items():
            panel.view = view
            page.goto(panel.url)
            page.wait_for_selector("body:not(.silent)")
            faults[name, dark] = judged(page, source)
        for name in PAGES:
            page.goto(panel.url.replace("/cell/line3", f"/{name}"))
            page.evaluate("document.body.classList.remove('silent')")
            faults[name, dark] = judged(page, source)
        panel.frozen = True
        page.goto(panel.url)
        time.sleep(2.5)
        for over in ("unstopped", "stopped", "note", "asleep"):
            page.evaluate(f"document.getElementById('{over}').hidden = false")
            faults[over, dark] = judged(page, source)
            page.evaluate(f"document.getElementById('{over}').hidden = true")
        panel.frozen = False
        context.close()
    assert {name: found for name, found in faults.items() if found} == {}


def judged(page, source):
    page.evaluate(source)
    rules = "{type: 'tag', values: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'best-practice']}"
    result = page.evaluate(f"axe.run(document, {{runOnly: {rules}}})")
    return [
        (one["id"], [node["html"][:120] for node in one["nodes"]][:3])
        for one in result["violations"]
    ]
