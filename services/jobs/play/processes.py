"""The processes of a match, in the order they are started; they end in reverse."""

from services.jobs.play.plan import Plan
from services.jobs.train.processes import listen_words
from services.supervisor import ProcessSpec, service_command
from shared.messages.training import AGENTS

LIVE = ("router", "robot-io", "policy", "referee")
"""How the names of the processes begin that a moving robot depends on."""


def processes(plan: Plan, endpoint: str) -> list[ProcessSpec]:
    """Return what to start.

    Args:
        plan: the match; its settings lie in ``config.toml`` of its folder.
        endpoint: of the router.
    """

    def spec(role: str, name: str, agent: str = "") -> ProcessSpec:
        command = service_command(
            role, name=name, run=plan.folder, site=plan.folder / "config.toml", run_id=plan.run,
            connect=() if role == "router" else (endpoint,), agent=agent,
        )  # fmt: skip
        extra = listen_words(plan.bus, endpoint) if role == "router" else ()
        return ProcessSpec(name, (*command, *extra), finishes=False)

    made = [spec("router", "router-0")]
    if plan.play.record:
        made.append(spec("recorder", "recorder-0"))
    made.append(spec("robot_io", "robot-io-0"))
    seats = (plan.antagonist, plan.protagonist)
    for agent, seat in zip(AGENTS, seats, strict=True):
        if not seat.is_person:
            made.append(spec("policy", f"policy-{agent}", agent))
    made.append(spec("referee", "referee-0"))
    if plan.has_page:
        made.append(spec("page", "page-0"))
    return made
