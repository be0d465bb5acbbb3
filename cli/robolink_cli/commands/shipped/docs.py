"""docs: the pages that come with robolink, read without a network."""

import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Final

import click

from robolink.messages import tr
from robolink_cli.console.person import is_terminal
from robolink_cli.console.render import emit_json, json_is_on, say, say_listed
from robolink_cli.console.tables import filled, has_wide, within
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option

_COMMENT: Final = re.compile(r"<!--.*?-->\n*", re.DOTALL)
"""HTML comments, which are for authors of a page. A browser hides them too."""


def _complete_page(_: click.Context, __: click.Parameter, start: str) -> list[str]:
    """Return the pages whose names begin so, for TAB."""
    return [name for name in _pages() if name.startswith(start)]


@click.command()
@json_option
def docs(
    *,
    page: Annotated[str | None, CliArgument(shell_complete=_complete_page)] = None,
    only_path: Annotated[
        bool, CliOption("--path", help="Show the path of the page, not the page.")
    ] = False,
) -> None:
    """Read a PAGE of the documentation; without PAGE, list the pages.

    The pages come with the program, so they match its version and need no network. A page is shown
    in the language of --lang if it exists in it.
    """
    pages = _pages()
    if page is None:
        titles = {name: _title(path) for name, path in pages.items()}
        _list(titles)
        return
    name = page.removesuffix(".md").removeprefix("docs/")
    from robolink_cli.commands.shipped.shipped_files import require_one_of

    missing = tr("No page {name!r}.", name=name)
    require_one_of(name, list(pages), missing, remedy=tr("To see all pages: robolink docs"))
    path = _in_language(pages[name])
    if json_is_on():
        text = path.read_text(encoding="utf-8")
        emit_json("robolink/page/1", {"name": name, "path": str(path), "text": text})
    elif only_path:
        say(str(path))
    else:
        _show(path.read_text(encoding="utf-8"))


def _pages() -> dict[str, Path]:
    """Return the pages by name: those of the top folder, then the reference."""
    from robolink_cli.commands.shipped.shipped_files import pages_folder

    folder = pages_folder()
    found = [*sorted(folder.glob("*.md")), *sorted(folder.glob("reference/*.md"))]
    return {
        path.relative_to(folder).as_posix().removesuffix(".md"): path
        for path in found
        if not path.stem.endswith(".zh")
    }


def _title(path: Path) -> str:
    with path.open(encoding="utf-8") as lines:
        return next((line.strip("# \n") for line in lines if line.startswith("# ")), "")


def _in_language(path: Path) -> Path:
    """Return the page in the language of the process, if there is one."""
    from robolink_cli.console.language import language_now

    other = path.with_suffix(f".{language_now()}.md")
    return other if other.is_file() else path


def _list(titles: dict[str, str]) -> None:
    if json_is_on():
        pages = [{"name": name, "title": title} for name, title in titles.items()]
        emit_json("robolink/pages/1", {"pages": pages})
        return
    say_listed(titles)
    say(tr("To read one: robolink docs PAGE"))


def _show(text: str) -> None:
    """Show a page: through the pager on a terminal, unchanged to a program."""
    if is_terminal(sys.stdout) and is_terminal(sys.stdin):
        click.echo_via_pager(page_lines(_COMMENT.sub("", text), shutil.get_terminal_size().columns))
    else:
        say(text.rstrip("\n"))


_AS_IT_STANDS: Final = re.compile(r"\s{4,}|[|#<>!]|```|\s*$")
_ITEM: Final = re.compile(r"\s*([*-]|\d+\.)\s")


def page_lines(text: str, width: int) -> str:
    """Return a page of Markdown for a terminal.

    The pages are wider than a terminal of 80 columns, which would break their lines in the middle
    of a word. Paragraphs and items of lists are filled anew; lines of tables, headings and code
    that are too long are broken at a blank.

    Args:
        text: The page.
        width: Columns of the terminal.
    """
    return "\n".join(
        filled(part, width, indent=part[: len(part) - len(part.lstrip())])
        if is_prose
        else within(part, width)
        for is_prose, part in _parts(text)
    )


def _parts(text: str) -> Iterator[tuple[bool, str]]:
    """Yield paragraphs and items, each joined to one line, and other lines; with their kind."""
    prose, in_code = "", False
    for line in text.split("\n"):
        fence = line.startswith("```")
        stands = in_code or fence or _AS_IT_STANDS.match(line) is not None
        if prose and (stands or _ITEM.match(line)):
            yield True, prose
            prose = ""
        if stands:
            yield False, line
        else:
            prose = _joined(prose, line.strip()) if prose else line
        in_code ^= fence
    if prose:
        yield True, prose


def _joined(line: str, following: str) -> str:
    """Return two lines as one; Chinese has no blank between words."""
    return line + following if has_wide(line[-1]) else f"{line} {following}"
