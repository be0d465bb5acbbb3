"""fleet: plans for many cells."""

from typing import Final

from robolink.messages import declared
from robolink_cli.lazy_group import LazyGroup

_HERE: Final = "robolink_cli.commands.fleet"

_COMMANDS: Final = {
    "plan": (f"{_HERE}.plan:plan", declared("Make a plan from a file, and keep it.")),
    "run": (
        f"{_HERE}.run:run",
        declared("Start a plan; carry it out here if no agent runs."),
    ),
    "next": (
        f"{_HERE}.next:next_job",
        declared("Carry out the job that a plan has for this cell."),
    ),
    "status": (
        f"{_HERE}.status:status",
        declared("Show how plans stand, and what each job waits for."),
    ),
    "halt": (f"{_HERE}.control:halt", declared("Halt a plan; what runs comes to its end.")),
    "resume": (
        f"{_HERE}.control:resume",
        declared("Let a halted plan, or its next ring, go on."),
    ),
    "permit": (f"{_HERE}.permit:permit", declared("Permits for plans: give list revoke")),
    "agent": (
        f"{_HERE}.agent:agent",
        declared("Carry out the plans of a plant, until it is ended."),
    ),
    "report": (
        f"{_HERE}.report:report",
        declared("Write a page about a plant: drift, recipes, plans."),
    ),
    "demo": (
        f"{_HERE}.demo:demo",
        declared("A plan for twenty simulated cells; its agent is killed twice."),
    ),
}

fleet = LazyGroup(
    name="fleet",
    lazy=_COMMANDS,
    help=declared("Plans for many cells: what each cell does, when, and how it ended."),
)
