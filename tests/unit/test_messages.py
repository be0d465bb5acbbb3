"""Every sentence goes through one door, in a form that can be collected and filled."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from robolink import messages
from robolink.messages import tr

ROOT = Path(__file__).parents[2]
PACKAGES = ("robolink", "cli/robolink_cli", "simulators/robolink_simulators")
CALLED = re.compile(r"\b(tr|declared)\s*\(")
"""Stands in every module that has a sentence; a tree of the others would show nothing."""


def sources():
    return sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


@cache
def looked_at():
    """Return each module with its calls and the lines that come too early; trees are large."""
    found = []
    for path in sources():
        source = path.read_text(encoding="utf-8")
        if CALLED.search(source):
            tree = ast.parse(source)
            found.append((path, list(sentences(tree)), list(too_early(tree))))
    return found


def sentences(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("tr", "declared"):
            yield node


def when_imported(top):
    """Yield what runs when a module is imported: bodies of functions do not."""
    waiting = [top]
    while waiting:
        node = waiting.pop()
        yield node
        if isinstance(node, ast.FunctionDef):
            defaults = [one for one in node.args.kw_defaults if one is not None]
            waiting += [*node.decorator_list, *node.args.defaults, *defaults]
        elif not isinstance(node, ast.Lambda):
            waiting += ast.iter_child_nodes(node)


def too_early(tree):
    """Yield the calls of ``tr`` at import, and those whose text click keeps."""
    kept = (
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.keyword) and node.arg in ("help", "short_help", "epilog")
    )
    for node in (*when_imported(tree), *kept):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "tr":
            yield node.lineno


def placeholders(sentence):
    """Names between braces; braces around anything else are text."""
    return set(re.findall(r"(?<!{){([a-z_]\w*)[^{}]*}", sentence))


@pytest.fixture
def shouted():
    messages.install(str.upper)
    yield
    messages.install(None)


def test_a_sentence_is_shown_as_it_stands_without_a_translation():
    assert tr("The tip moved {distance_mm:.3f} mm.", distance_mm=0.25) == "The tip moved 0.250 mm."


def test_braces_without_values_are_left_alone():
    assert tr('Write {"a": 1}.') == 'Write {"a": 1}.'


def test_a_translation_is_asked_for_the_sentence_before_it_is_filled(shouted):
    assert tr("Connect again.") == "CONNECT AGAIN."


def test_every_sentence_is_a_literal_that_gets_exactly_its_values():
    wrong, seen = [], 0
    for path, calls, _ in looked_at():
        for call in calls:
            seen += 1
            place = f"{path.relative_to(ROOT)}:{call.lineno}"
            (sentence,) = call.args
            if not isinstance(sentence, ast.Constant):
                wrong.append(f"{place}: not a literal, cannot be collected")
                continue
            given = {keyword.arg for keyword in call.keywords}
            wanted = placeholders(str(sentence.value))
            if None not in given and wanted != given:  # **values cannot be counted here
                wrong.append(f"{place}: the sentence wants {wanted}, gets {given}")
    assert not wrong
    assert seen > 1000


def test_nothing_is_translated_before_the_language_is_known():
    wrong = [
        f"{path.relative_to(ROOT)}:{line}: declared(...) here, spoken(...) where it is shown"
        for path, _, lines in looked_at()
        for line in lines
    ]
    assert not wrong


def test_what_would_be_translated_too_early_is_found():
    source = (
        'A = tr("a")\nclass B:\n    c = {1: tr("c")}\n@option(help=tr("d"))\ndef f(x=tr("x")):\n'
        '    g = option(help=tr("g"))\n    return tr("no")\n'
    )
    assert sorted(set(too_early(ast.parse(source)))) == [1, 3, 4, 5, 6]
