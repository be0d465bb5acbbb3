"""A table whose rows one test checks: pytest's own work for a test is more than most rows cost."""

import inspect
import traceback
from collections.abc import Callable, Iterable
from functools import wraps
from typing import Any

import pytest

_MARKED = type(pytest.param())


def each_row(
    names: str | tuple[str, ...], rows: Iterable[Any]
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Call a test with each row in turn, and fail it with all rows that failed.

    Takes the names and rows that ``pytest.mark.parametrize`` takes. It is for tests of which no
    row leaves anything to the next one: a fixture of the test is made once for all of them.
    """
    columns = tuple(name.strip() for name in names.split(",")) if isinstance(names, str) else names
    table = [_values(row, columns) for row in rows]

    def decorate(check: Callable[..., None]) -> Callable[..., None]:
        signature = inspect.signature(check)
        others = [one for name, one in signature.parameters.items() if name not in columns]
        assert len(others) + len(columns) == len(signature.parameters), check

        @wraps(check)
        def checks(*args: Any, **fixtures: Any) -> None:
            assert table, "a table without rows checks nothing"
            failed = []
            for values in table:
                row = dict(zip(columns, values, strict=True))
                try:
                    check(*args, **fixtures, **row)
                except (Exception, pytest.fail.Exception) as error:
                    failed.append(_told(row, error))
            if failed:
                pytest.fail(f"{len(failed)} of {len(table)} rows:\n" + "\n".join(failed), False)

        checks.__signature__ = signature.replace(parameters=others)  # type: ignore[attr-defined]
        return checks

    return decorate


def in_turn(rows: Iterable[Any], columns: Iterable[Any], name: Callable[[Any], str]) -> list[Any]:
    """Return each pair of a row and a column; every second one, as on a chessboard, is for soak.

    Args:
        rows: The first of each pair.
        columns: The second.
        name: Names a row in the test's id.
    """
    columns = tuple(columns)
    return [
        pytest.param(
            row, column, id=f"{name(row)}-{column}", marks=pytest.mark.soak if (r + c) % 2 else ()
        )
        for r, row in enumerate(rows)
        for c, column in enumerate(columns)
    ]


def _values(row: Any, columns: tuple[str, ...]) -> tuple[Any, ...]:
    assert not isinstance(row, _MARKED), "a row with marks is a test of its own"
    return tuple(row) if len(columns) > 1 else (row,)


def _told(row: dict[str, Any], error: BaseException) -> str:
    """Return a row that failed, the lines on the way to where it did, and why."""
    given = ", ".join(f"{name}={value!r}" for name, value in row.items())
    behind = traceback.extract_tb(error.__traceback__)[1:]
    place = f"{behind[-1].filename}:{behind[-1].lineno}: " if behind else ""
    return f"\n{given}\n    {place}{type(error).__name__}: {error}"
