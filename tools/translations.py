"""Keeps the translations in step with the sentences: ``make messages``.

Each ``.po`` is written anew: the sentences that there are, sorted, without places and dates, so
that two branches seldom touch the same lines. Where they did, both sides of the merge are read
from git and put together. What has no translation yet is counted, and printed with ``--missing``.
"""

import argparse
import subprocess
import sys
from collections.abc import Iterable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Final

import click
from babel.messages.catalog import Catalog
from babel.messages.extract import extract_from_dir
from babel.messages.pofile import read_po, write_po

ROOT: Final = Path(__file__).parents[1]
LOCALE: Final = ROOT / "robolink" / "locale"
TEMPLATE: Final = LOCALE / "robolink.pot"
CHINESE: Final = LOCALE / "zh_CN" / "LC_MESSAGES"

_WIDTH: Final = 100
_HEAD: Final = """\
# Chinese sentences of robolink. No native technician has read them on the screen yet.
msgid ""
msgstr ""
"Language: zh_CN\\n"
"MIME-Version: 1.0\\n"
"Content-Type: text/plain; charset=utf-8\\n"
"Content-Transfer-Encoding: 8bit\\n"
"Plural-Forms: nplurals=1; plural=0;\\n"

"""

Sentence = str | list[str] | tuple[str, ...]


def main() -> int:
    """Bring the catalogues up to date and say what is missing; 0 when nothing is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missing", action="store_true", help="print what is not translated")
    arguments = parser.parse_args()
    missing: list[Sentence] = []
    for name, sentences in (("robolink", ours()), ("click", of_click())):
        path = CHINESE / f"{name}.po"
        missing += renew(path, sentences)
    for sentence in missing if arguments.missing else ():
        sys.stdout.write(f"{sentence!r}\n")
    sys.stdout.write(f"not translated into Chinese: {len(missing)}\n")
    return 1 if missing else 0


def renew(path: Path, sentences: Iterable[Sentence]) -> list[Sentence]:
    """Write a ``.po`` with just these sentences; return those without a translation."""
    known = dict(_known(path))
    catalog = Catalog(locale="zh_CN")
    missing = []
    for sentence in sentences:
        if sentence in catalog:
            continue
        translation = known.get(_name(sentence), "")
        catalog.add(sentence, translation if isinstance(sentence, str) else (translation,))
        if not translation:
            missing.append(sentence)
    path.write_text(_HEAD + text_of(catalog), encoding="utf-8")
    return missing


def text_of(catalog: Catalog) -> str:
    """Return the entries of a catalogue as they stand in its file."""
    made = BytesIO()
    write_po(made, catalog, width=_WIDTH, no_location=True, omit_header=True, sort_output=True)
    return made.getvalue().decode().lstrip("\n")


def ours() -> Iterator[Sentence]:
    """Yield the sentences of robolink."""
    with TEMPLATE.open("rb") as file:
        yield from (message.id for message in read_po(file) if message.id)


def of_click() -> Iterator[Sentence]:
    """Yield the sentences that the installed click shows by itself."""
    folder = Path(click.__file__).parent
    for _, _, sentence, _, _ in extract_from_dir(folder, [("**.py", "python")]):
        yield sentence
    yield "required"  # click translates what it looks up here, which no extraction sees


def _known(path: Path) -> Iterator[tuple[str, str]]:
    """Yield each sentence and its translation; of a merge in conflict, those of both sides."""
    for text in _versions(path):
        for message in read_po(BytesIO(text)):
            translation = _name(message.string or "")
            if message.id and translation:
                yield _name(message.id), translation


def _name(sentence: Sentence) -> str:
    return sentence if isinstance(sentence, str) else sentence[0]


def _versions(path: Path) -> Iterator[bytes]:
    listed = ["git", "ls-files", "--unmerged", "--", str(path)]
    found = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=False)
    sides = [line.split()[1] for line in found.stdout.splitlines()]
    if not sides:
        if path.is_file():
            yield path.read_bytes()
        return
    for side in sides:
        yield subprocess.run(
            ["git", "cat-file", "blob", side], cwd=ROOT, capture_output=True, check=True
        ).stdout


if __name__ == "__main__":
    sys.exit(main())
