"""--faults: what a fault plan lets go wrong, and the line that tells of each."""

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

from robolink_simulators.faults import LinkKind, fault_as_keys, read_fault_file

from robolink.messages import tr
from robolink_cli.console.output import hand_over, show
from robolink_cli.console.render import json_is_on


def plan_faults(simulator: Any, file: Path | None, served: Collection[LinkKind]) -> None:  # noqa: ANN401 - any simulator with faults
    """Plan what a file says; each fault that fires is told then, in one line on stdout.

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
            document = {"schema": "robolink/fault/1", "fault": keys, "request": request}
            hand_over(json.dumps({**document, "simulated_s": simulator.now_ns / 1e9}))
        else:
            show(tr("FAULT {action}: {request}", action=keys["action"], request=request))

    simulator.faults.on_fired = tell
