"""The catalogue of sentences: complete, translated, and without two wordings of one message."""

import ast
import io
import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from string import Formatter

import pytest
from babel.messages.frontend import CommandLineInterface
from babel.messages.pofile import read_po
from robolink_cli.console.tables import columns, filled

import robolink
from robolink.model import ControllerState, ControllerStatus, Hand
from robolink.report._markup import plain
from tests.packaging._near_copies import near_copies, reviewed, sentences
from tools.sentences import HOLDS_ONE, collect, collected

# Every sentence goes through one function, in a form that can be collected and filled.

ROOT = Path(__file__).parents[2]
PACKAGES = ("robolink", "cli/robolink_cli", "simulators/robolink_simulators")


@dataclass(frozen=True)
class Said:
    """The sentences of a module; its parse tree is large."""

    path: Path
    collected: Sequence[object]
    """As ``make messages`` collects them."""
    calls: list[ast.Call]
    too_early: list[int]
    """Lines in which one is translated before the language is known."""


@pytest.fixture(scope="module")
def modules():
    """Every module of the sources with a sentence, by its text: each is parsed once."""
    found = {}
    for path in sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        source = path.read_bytes()
        if HOLDS_ONE.search(source):
            nodes = list(sayers(tree := ast.parse(source)))
            said = list(collected(nodes, ("tr", "declared")))
            found[source] = Said(path, said, list(calls(nodes)), list(too_early(tree, nodes)))
    return found


LEAVES = (ast.Name, ast.Constant, ast.expr_context, ast.operator, ast.cmpop, ast.alias)


def sayers(tree):
    """Yield the nodes that may say something, in a third of the time of ``ast.walk``."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, (ast.Call, ast.FunctionDef, ast.keyword)):
            yield node
        for name in node._fields:
            value = getattr(node, name)
            for one in value if isinstance(value, list) else (value,):
                if isinstance(one, ast.AST) and not isinstance(one, LEAVES):
                    waiting.append(one)


def calls(nodes):
    for node in nodes:
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("tr", "declared"):
            yield node


def when_imported(top):
    """Yield the code that runs at import: the bodies of functions do not."""
    waiting = [top]
    while waiting:
        node = waiting.pop()
        yield node
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            defaults = [one for one in node.args.kw_defaults if one is not None]
            waiting += [*node.decorator_list, *node.args.defaults, *defaults]
        elif not isinstance(node, ast.Lambda):
            waiting += ast.iter_child_nodes(node)


def too_early(tree, nodes):
    """Yield the calls of ``tr`` at import, and those whose text click keeps."""
    kept = (
        node.value
        for node in nodes
        if isinstance(node, ast.keyword) and node.arg in ("help", "short_help", "epilog")
    )
    for node in (*when_imported(tree), *kept):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "tr":
            yield node.lineno


def placeholders(sentence):
    """Return the names in braces; other text in braces is text."""
    return set(re.findall(r"(?<!{){([a-z_]\w*)[^{}]*}", sentence))


def test_every_sentence_is_a_literal_that_gets_exactly_its_values(modules):
    wrong, seen = [], 0
    for module in modules.values():
        for call in module.calls:
            seen += 1
            place = f"{module.path.relative_to(ROOT)}:{call.lineno}"
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


def test_nothing_is_translated_before_the_language_is_known(modules):
    wrong = [
        f"{module.path.relative_to(ROOT)}:{line}: declared(...) here, spoken(...) where it is shown"
        for module in modules.values()
        for line in module.too_early
    ]
    assert not wrong


def test_what_would_be_translated_too_early_is_found():
    source = (
        'A = tr("a")\nclass B:\n    c = {1: tr("c")}\n@option(help=tr("d"))\ndef f(x=tr("x")):\n'
        '    g = option(help=tr("g"))\n    return tr("no")\n'
    )
    tree = ast.parse(source)
    assert sorted(set(too_early(tree, ast.walk(tree)))) == [1, 3, 4, 5, 6]


# A sentence of the library names the next step in the words of the program that shows it.

LIBRARY = Path(robolink.__file__).parent
OPTION = re.compile(r"(?<![\w-])--[a-z]")


def own_sentences(module):
    """Yield a module's sentences for people, among its calls."""
    for node in module.calls:
        if node.func.id == "tr" and isinstance(node.args[0], ast.Constant):
            yield node.args[0].value


def test_no_sentence_of_the_library_names_an_option_of_the_command_line(modules):
    found = [
        (str(module.path.relative_to(LIBRARY)), text)
        for module in modules.values()
        if module.path.is_relative_to(LIBRARY)
        for text in own_sentences(module)
        if OPTION.search(text)
    ]
    assert found == []


# The catalogue of sentences is complete.

CATALOGUE = ROOT / "robolink" / "locale" / "robolink.pot"


def recipe():
    """Return the options with which ``make messages`` collects."""
    makefile = (ROOT / "Makefile").read_text().replace("\\\n", " ")
    (line,) = re.findall(r"babel\.messages\.frontend (--quiet extract .*)", makefile)
    return line.split()


def test_the_catalogue_holds_what_the_sources_say(modules, tmp_path, monkeypatch):
    fresh = tmp_path / "robolink.pot"
    options = [
        f"--output-file={fresh}" if option.startswith("--output-file") else option
        for option in recipe()
    ]
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(logging.getLogger("babel"), "handlers", [])
    known = {text: module.collected for text, module in modules.items()}
    # Babel calls it for each module of the sources, which are parsed already.
    monkeypatch.setattr(
        "tools.sentences.collect", lambda file, *_, **__: known.get(file.read(), [])
    )
    CommandLineInterface().run(["pybabel", *options])
    assert fresh.read_text() == CATALOGUE.read_text(), "run: make messages"


# Every translation fills in the same values, in a form that a terminal displays correctly.

CHINESE = CATALOGUE.parent / "zh_CN" / "LC_MESSAGES"

AMBIGUOUS = "\u00b1\u00b0\u2192\u2026\u201c\u201d\u2500"
"""One column wide on some consoles and two on others (cp936)."""

OTHER_WORDS = {"刀具": "工具", "标定": "校准", "教导": "示教", "马达": "电机", "重置": "复位"}
"""A word that is not used, and its replacement: one word for one thing."""

NAMED = re.compile(r"(?<![\w-])--[a-z][a-z-]+|\b[a-z]+_(?:mm|deg)\b|\$[A-Z]\w+|[\w/]+\.(?:md|toml)")
"""Names of options, keys, statements and files, which are the same in every language."""


def entries(path):
    with path.open("rb") as file:
        return [message for message in read_po(file) if message.id]


@pytest.fixture(scope="module")
def translated():
    return [(message.id, message.string) for message in entries(CHINESE / "robolink.po")]


def values(sentence):
    """Return the placeholders with their conversions, unordered."""
    return sorted(part[1:] for part in map(str_part, Formatter().parse(sentence)) if part[1])


def str_part(part):
    return tuple(piece or "" for piece in part)


def is_filled(sentence):
    """Return whether ``tr`` fills the sentence in; otherwise braces are text."""
    return re.search(r"(?<!{){[a-z_]\w*[^{}]*}", sentence) is not None


def faults(english, chinese):
    if is_filled(english):
        try:
            same = values(english) == values(chinese)
        except ValueError:
            same = False
        if not same:
            yield "other placeholders"
    if (
        english[: len(english) - len(english.lstrip())]
        != chinese[: len(chinese) - len(chinese.lstrip())]
    ):
        yield "other blanks in front"
    if english.count("\\b\n") != chinese.count("\\b\n"):
        yield "another part keeps its lines"
    yield from (f"{word}: write {other}" for word, other in OTHER_WORDS.items() if word in chinese)
    strange = {sign for sign in AMBIGUOUS if sign in chinese} - set(english)  # a page may have it
    yield from (f"{sign!r} is two columns wide somewhere" for sign in sorted(strange))
    yield from (f"{name} is missing" for name in NAMED.findall(english) if name not in chinese)


def test_every_sentence_has_a_translation(translated):
    """``python tools/translations.py --missing`` prints the sentences without one."""
    said = dict(translated)
    assert sorted(said) == sorted(one.id for one in entries(CATALOGUE)), "run: make messages"
    assert [english for english, chinese in translated if not chinese] == []


PLACES = {
    12: ("Touch", "off by"),
    14: ("now", "new", "change"),
    13: ("Flange now", "Tip now", "Since arrival", "Since start", "Lowest", "Highest", "Contact"),
    6: ("OK", "TO DO", "YOU"),
    4: ("LOOK",),
    10: ("stays", "motors on", "motors OFF", "power LOW", "power HIGH"),
    20: ("Z+ up", "Z- down", "Turn keys"),
}
"""Column widths on the wizard's screens, and their texts."""


@pytest.mark.parametrize("widest", [(one, most) for most, those in PLACES.items() for one in those])
def test_what_stands_in_columns_keeps_to_them(translated, widest):
    english, most = widest
    assert columns(dict(translated)[english]) <= most


def test_sentences_inside_of_f_strings_are_collected():
    source = b"""shown = f"{tr('Z+ up')} {declared('Turn keys')}"\n"""
    found = collect(io.BytesIO(source), {"tr": None, "declared": None}, [], {})
    assert [sentence for _, _, sentence, _ in found] == ["Z+ up", "Turn keys"]


def test_a_translation_says_what_the_sentence_says(translated):
    wrong = [
        f"{english!r}: {fault}"
        for english, chinese in translated
        if chinese
        for fault in faults(english, chinese)
    ]
    assert not wrong


@pytest.mark.parametrize(
    ("english", "chinese", "fault"),
    [
        ("{a:.3f} mm", "{b:.3f} mm", "other placeholders"),
        ("{a:.3f} mm", "{a:.2f} mm", "other placeholders"),
        ("{a} mm", "{a} {a} mm", "other placeholders"),
        ("{a} mm", "毫米", "other placeholders"),
        ("{a} mm", "{a 毫米", "other placeholders"),
        ("  {a} mm", "{a} 毫米", "other blanks in front"),
        ("Give --tool.", "给出 --工具。", "--tool is missing"),
        ("A tool.", "刀具。", "刀具: write 工具"),
    ],
)
def test_a_faulty_translation_is_found(english, chinese, fault):
    assert fault in list(faults(english, chinese))
    assert not list(faults(english, english))


def test_what_click_says_is_translated_with_the_same_values():
    said = [(one.id, one.string) for one in entries(CHINESE / "click.po")]
    assert len(said) > 50
    for ids, strings in said:
        english, chinese = (text if isinstance(text, str) else text[0] for text in (ids, strings))
        assert chinese, english
        if "{" in english:
            assert values(english) == values(chinese), english


def test_columns_are_counted_as_a_terminal_shows_them():
    assert columns("Tool 1") == 6
    assert columns("工具 1") == 6


def test_a_bracket_is_not_left_alone_at_the_end_of_a_line():
    said = "旋转(例如龙门)为 0。 [默认：180.0]"  # noqa: RUF001
    for width in range(12, columns(said)):
        lines = filled(said, width).split("\n")
        assert all(columns(line) <= width for line in lines)
        assert not [line for line in lines if line.endswith(("(", "["))]
        assert "".join(lines).replace(" ", "") == said.replace(" ", "")


def test_what_a_machine_can_be_said_to_be_has_a_word(translated):
    said = dict(translated)
    flags = [field.name.replace("_", " ") for field in fields(ControllerStatus)]
    codes = [*ControllerState, *flags, *(f"{hand} hand" for hand in Hand)]
    assert len(codes) > 20
    shown_otherwise = {"code", "unpowered"}  # a number; the state "without power"
    assert [code for code in codes if not said.get(str(code)) and code not in shown_otherwise] == []


# One message is one sentence: no two in the catalogue say the same in other words.


def test_no_sentence_is_all_but_a_copy_of_another():
    """A pair that is meant to differ goes into ``near_copies.txt``; else one of them goes."""
    found = set(near_copies(sentences()))
    assert len(found & reviewed()) > 50, "the search finds nothing, or the list is of another day"
    assert sorted(found - reviewed()) == []


@pytest.mark.parametrize(
    "other",
    [
        "Check the cable and the controller's power, then try again.",
        "Check the cable and the controller's power, then connect.",
        "Check cable and the controller's power, then connect once again.",
    ],
)
def test_a_near_copy_is_found(other):
    sentence = "Check the cable and the controller's power, then connect again."
    assert list(near_copies([sentence, other])) == [tuple(sorted((sentence, other)))]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Tool {tool} was written and read back.", "Tool {other} was written and read back."),
        ("the file is not there", "the file is not here"),
        ("Nothing was sent. Name another file of poses.", "Nothing was sent. Press the switch."),
    ],
)
def test_other_values_labels_and_other_sentences_are_none(one, other):
    assert list(near_copies([one, other])) == []


# Sentences contain ``+-``, which every console has; one function turns it into the sign on pages.

SHIPPED = ("robolink", "cli", "simulators", "companions", "docs")
OTHER_WAYS = ("\u00b1", r"\u00b1", "+/-")
ONE_PLACE = "robolink/report/_markup.py"
OF_OTHERS = "cli/robolink_cli/console/output.py"
"""Writes other people's text for a console that lacks the sign."""


def test_no_source_and_no_page_has_another_way():
    found = {
        path.relative_to(ROOT).as_posix()
        for folder in SHIPPED
        for ending in ("py", "html", "md", "st", "prg")
        for path in (ROOT / folder).rglob(f"*.{ending}")
        if any(way in path.read_text(encoding="utf-8") for way in OTHER_WAYS)
    }
    assert found == {ONE_PLACE, OF_OTHERS}


def test_no_translation_has_another_way():
    said = [one.string for one in entries(CHINESE / "robolink.po")]
    assert len(said) > 1000
    assert [text for text in said if any(way in str(text) for way in OTHER_WAYS)] == []


@pytest.mark.parametrize(
    ("sentence", "shown"),
    [
        ("X, Y: repeatable to +-0.035 mm (95 %).", "X, Y: repeatable to \u00b1 0.035 mm (95 %)."),
        ("seems longer (+-0.14 mm)", "seems longer (\u00b1 0.14 mm)"),
        (
            "the +- is taken from how well they agree",
            "the \u00b1 is taken from how well they agree",
        ),
        ("+-", "\u00b1 "),
        ("可重复至+-0.035 mm", "可重复至\u00b1 0.035 mm"),
        # Text that is not a half width stays as written.
        ("needle A+-2", "needle A+-2"),
        ("x+-y", "x+-y"),
    ],
)
def test_a_page_shows_the_sign(sentence, shown):
    assert plain(sentence) == shown
