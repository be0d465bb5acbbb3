"""Histories of a cell's tools as a real cell might have them, drawn from a seed."""

import random
from collections.abc import Callable

from robolink.drift import MeasuredChange

SEAT_MM, TOUCH_MM = 0.02, 0.005

Shift = Callable[[int, int], tuple[float, float, float]]


def steady(_index: int, _tool: int) -> tuple[float, float, float]:
    return 0.0, 0.0, 0.0


def course(
    seed: int | str,
    count: int,
    *,
    tools: int = 1,
    shift: Shift = steady,
    pin: Callable[[int], float] = lambda _: 0.0,
    each_nozzle: int = 1,
    wear_mm: float = 0.0,
    ids: bool = True,
) -> list[MeasuredChange]:
    """Return changes of a cell.

    Args:
        seed: The seed of the scatter.
        count: Changes of each tool.
        tools: Number of tools.
        shift: The shift of a tool's tip at a change, mm.
        pin: The same for X of the pin.
        each_nozzle: How often a nozzle is measured before the next is mounted.
        wear_mm: The loss of length each time.
        ids: Whether somebody gives the nozzles ids.
    """
    rng, made, seat = random.Random(seed), list[MeasuredChange](), dict[int, list[float]]()
    for index in range(count):
        for tool in range(1, tools + 1):
            if index % each_nozzle == 0:
                seat[tool] = [rng.gauss(0, SEAT_MM) for _ in range(3)]
            worn = wear_mm * (index % each_nozzle)
            x, y, z = (
                nominal + seated + moved + rng.gauss(0, TOUCH_MM)
                for nominal, seated, moved in zip(
                    (12.0, -3.5, -20.0), seat[tool], shift(index, tool), strict=True
                )
            )
            number = len(made) + 1
            made.append(
                MeasuredChange(
                    number=number,
                    at=f"2026-{1 + index // 28:02}-{1 + index % 28:02}T08:00:00.000Z",
                    change=f"{number:032x}",
                    tool=tool,
                    nozzle=f"N-{tool}-{index // each_nozzle}" if ids else "",
                    station="PIN",
                    tip_mm={"x": x, "y": y, "z": z + worn},
                    pin_mm={
                        "x": 300 + pin(index) + rng.gauss(0, TOUCH_MM),
                        "y": 100 + rng.gauss(0, TOUCH_MM),
                    },
                    turn_test_mm=abs(rng.gauss(0, 0.015)),
                )
            )
    return made


def found(changes: list[MeasuredChange]) -> set[str]:
    """Return the codes of the findings after the last change."""
    from robolink.drift import charts_of, findings_in

    return {str(finding.code) for finding in findings_in(charts_of(changes), changes)}
