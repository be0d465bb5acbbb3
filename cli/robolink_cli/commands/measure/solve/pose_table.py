"""A table of poses as a case: one pose a line, columns named in the first line or by option."""

from pathlib import Path
from typing import Final

from robolink.files.named import read_named
from robolink.messages import tr
from robolink_cli.commands.measure.solve.case import Node, unusable

COLUMNS: Final = ("x", "y", "z", "u", "v", "w", "qx", "qy", "qz", "qs", "hand")


def table_case(
    path: Path,
    *,
    method: str,
    columns: str | None,
    sigma_mm: float | None,
    threshold_mm: float | None,
) -> Node:
    """Return the case of a file with one pose a line.

    Args:
        path: Values stand apart by commas, semicolons, tabs or spaces.
        method: A method that takes poses on one point.
        columns: What the columns are; without it the first line says so.
        sigma_mm: Standard deviation of one placement, if it is known.
        threshold_mm: Residual beyond which a robust method rejects a pose.

    Raises:
        ConfigError: It cannot be read or is laid out in another way.
    """
    try:
        text = read_named(path).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        cause = str(error) if isinstance(error, UnicodeDecodeError) else error.strerror
        raise unusable(str(path), tr("it cannot be read ({error})", error=cause)) from error
    rows = [_cells(line) for line in text.splitlines() if line.strip()]
    names = _cells(columns) if columns is not None else (rows.pop(0) if rows else [])
    unknown = [name for name in names if name not in COLUMNS]
    if unknown or len(set(names)) != len(names) or not names:
        raise unusable(
            str(path),
            tr("the columns have to be named, each once, from {names}", names=", ".join(COLUMNS)),
        )
    poses = []
    for number, row in enumerate(rows):
        if len(row) != len(names):
            raise unusable(f"input.poses[{number}]", tr("it has another number of columns"))
        poses.append({n: _value(n, cell) for n, cell in zip(names, row, strict=True)})
    given: dict[str, object] = {"poses": poses}
    given |= {} if sigma_mm is None else {"sigma_mm": sigma_mm}
    given |= {} if threshold_mm is None else {"inlier_threshold": threshold_mm}
    return Node({"id": path.name, "method": method, "input": given}, "")


def _cells(line: str) -> list[str]:
    for separator in (";", ","):
        if separator in line:
            return [cell.strip() for cell in line.split(separator)]
    return line.split()


def _value(name: str, cell: str) -> object:
    if name == "hand":
        return cell
    try:
        return float(cell)
    except ValueError:
        return cell
