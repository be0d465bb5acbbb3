"""What the journal adds: the judgements, its entries, and whether they are as they were stored."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from robolink.messages import tr
from robolink.report._markup import element
from robolink.report._values import Record, Report
from robolink.report.sections.offsets import table


def judgements(report: Report) -> Iterator[Element]:
    """Yield what was allowed and what was found, in words."""
    if not report.judgements:
        return
    rows = [
        element(
            "tr",
            *(_word(text) for text in (judged.what, judged.allowed or "-", judged.found or "-")),
        )
        for judged in report.judgements
    ]
    yield element("h2", tr("What was judged"))
    yield _words(("", tr("allowed"), tr("found")), rows)


def evidence(record: Record | None) -> Iterator[Element]:
    """Yield the entries with their hashes, and what the check of the journal found."""
    if record is None:
        return
    yield element("h2", tr("Entries of the journal"))
    yield element("p", record.check, class_="bad lead" if record.problems else "lead")
    if record.problems:
        problems = (element("li", problem) for problem in record.problems)
        yield element("ul", *problems, class_="warnings")
    rows = [
        element(
            "tr",
            element("td", str(entry.number)),
            _word(entry.at[:19].replace("T", " ")),
            _word(str(entry.kind)),
            _word("" if entry.tool is None else str(entry.tool)),
            element("td", entry.hash, class_="hash"),
        )
        for entry in record.entries
    ]
    columns = (tr("number"), tr("time (UTC)"), tr("kind"), tr("tool"), tr("SHA-256"))
    yield _words(columns, rows, class_="dense")
    yield element(
        "p",
        tr(
            "Each hash is over all fields of its entry and over the hash of the entry before. "
            "'robolink journal show NUMBER' shows the entry; the hashes must be these."
        ),
        class_="small",
    )


def _words(columns: tuple[str, ...], rows: list[Element], **attributes: object) -> Element:
    made = table(columns, rows, **attributes)
    for head in made.iter("th"):
        head.set("class", "word")
    return made


def _word(text: str) -> Element:
    return element("td", text, class_="word")
