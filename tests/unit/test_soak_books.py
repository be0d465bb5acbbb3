"""What the adversary reads of a journal whose file has lost pages."""

import sqlite3
from contextlib import closing

import pytest

from tests.soak.adversary.books import Books


@pytest.fixture
def books(tmp_path):
    path = tmp_path / "journal.db"
    with closing(sqlite3.connect(path)) as file, file:
        file.execute("CREATE TABLE markers (id, operation, kind, request, details)")
        file.execute("CREATE TABLE leases (token, holder)")
        file.execute("CREATE TABLE entries (number, proved_tool, details)")
        file.execute("INSERT INTO markers VALUES (NULL, NULL, NULL, NULL, NULL)")
        file.execute("INSERT INTO leases VALUES (1, '{\"pid\":')")
        file.execute("INSERT INTO entries VALUES (1, 2, NULL)")
    found = Books(path)
    yield found
    found.close()


@pytest.mark.parametrize(
    ("look", "nothing"),
    [
        (lambda books: books.markers(), []),
        (lambda books: books.holder(), None),
        (lambda books: books.value_of(2), (False, None)),
    ],
)
def test_rows_of_which_half_is_lost_are_damage_and_no_defect(books, look, nothing):
    assert look(books) == nothing
    assert not books.trusted
