"""--faults: what a fault plan lets go wrong, and the line that tells of each."""

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

from robolink_simulators.faults import LinkKind, fault_as_keys, read_fault_file

from robolink.messages import tr
from robolink.timing import NS_PER_S
from robolink_cli.console.output import hand_over, show
from robolink_cli.console.render import json_is_on


def plan_faults(
    simulator: Any,  # noqa: ANN401 - any simulator with faults
    file: Path | None,
    served: Collection[LinkKind],
    *,
    cell: str = "",
) -> None:
    """Plan what a file says; each fault that fires is told then, in one line on stdout.

    Args:
        simulator: For which.
        file: The file, if any.
        served: The links that it will be served on.
        cell: Its name among several, which is told with each fault.

    Raises:
        ConfigError: The file is wrong, or a fault cannot happen on any link that is served.
    """
    if file is None:
        return
    plan = read_fault_file(file)
    simulator.faults.plan(plan.faults, plan.seed, served)
    as_json = json_is_on()

    def tell(fault: Any, request: str) -> None:  # noqa: ANN401 - of any simulator
        keys = fault_as_keys(fault)
        if as_json:
            named = {"cell": cell} if cell else {}
            document = {"schema": "robolink/fault/1", **named, "fault": keys, "request": request}
            hand_over(json.dumps({**document, "simulated_s": simulator.now_ns / NS_PER_S}))
        else:
            told = tr("FAULT {action}: {request}", action=keys["action"], request=request)
            show(f"{cell}: {told}" if cell else told)

    simulator.faults.on_fired = tell
