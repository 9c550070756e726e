"""Which sites and crowds are measured: in earnest, on a busy machine, or to see that it works."""

import dataclasses
from typing import Literal

from benchmarks.scaling.site import Crowd, Setup

Purpose = Literal["fit", "check", "memory", "crowding"]
Step = tuple[Purpose, Crowd]


@dataclasses.dataclass(frozen=True)
class Plan:
    """What one measurement consists of."""

    sites: tuple[tuple[Setup, tuple[Step, ...]], ...]
    """Each with its crowds, in the order they come: ``fit`` yields coefficients, ``check`` is
    predicted from them, ``memory`` stays longer, ``crowding`` only shows what happens."""
    real_actors: tuple[int, ...]
    """Training runs with so many real actors; they are predicted."""
    rounds: int
    """Rollouts and updates from which an actor's cost and PPO's are taken."""
    seconds: float
    """Each crowd and run is watched for."""
    memory_seconds: float
    lease_seconds: float = 2.0
    """Of a link on the bus: the default, longer where the machine is so busy that it lapses."""


SMALL = Setup("16 bouts, batch 64", batch_rollouts=64, num_envs=16)
OFTEN = Setup("16 bouts, batch 8", batch_rollouts=8, num_envs=16)
DEFAULT = Setup("128 bouts, batch 4", batch_rollouts=4, num_envs=128)
LEARNING = Setup("128 bouts, batch 4, PPO", batch_rollouts=4, num_envs=128, updates=True)

FULL = Plan(
    sites=(
        (DEFAULT, (("fit", Crowd(8, 8.0)), ("fit", Crowd(8, 24.0)), ("check", Crowd(8, 0.0)))),
        (OFTEN, (("fit", Crowd(20, 20.0)), ("fit", Crowd(60, 60.0)))),
        (
            SMALL,
            (
                ("fit", Crowd(25, 25.0)),
                ("check", Crowd(50, 75.0)),
                ("fit", Crowd(100, 100.0)),
                ("check", Crowd(200, 100.0)),
                ("fit", Crowd(400, 100.0, hosts=4)),
                ("check", Crowd(600, 100.0, hosts=4)),
                ("fit", Crowd(800, 60.0, hosts=4)),
                ("memory", Crowd(1000, 100.0, hosts=4)),
            ),
        ),
        (
            LEARNING,
            (
                ("crowding", Crowd(4, 0.0)),
                ("crowding", Crowd(16, 0.0)),
                ("crowding", Crowd(64, 0.0)),
            ),
        ),
    ),
    real_actors=(1, 2, 3, 4),
    rounds=20,
    seconds=20.0,
    memory_seconds=180.0,
)
"""For a quiet machine: about twenty minutes on two cores."""

BUSY = Plan(
    sites=(
        (
            SMALL,
            (
                ("fit", Crowd(20, 6.0, hosts=1)),
                ("check", Crowd(50, 10.0, hosts=1)),
                ("fit", Crowd(400, 10.0)),
                ("memory", Crowd(600, 10.0)),
                ("fit", Crowd(100, 10.0, hosts=1)),
            ),
        ),
        (DEFAULT, (("fit", Crowd(4, 1.0)), ("fit", Crowd(4, 3.0)))),
        (OFTEN, (("fit", Crowd(6, 4.0)), ("fit", Crowd(12, 8.0)))),
        (LEARNING, (("crowding", Crowd(4, 0.0, hosts=1)), ("crowding", Crowd(24, 0.0, hosts=1)))),
    ),
    real_actors=(1, 2),
    rounds=5,
    seconds=15.0,
    memory_seconds=60.0,
    lease_seconds=30.0,
)
"""Where others use the machine: rates so low that CPU seconds still mean something."""

SMOKE = Plan(
    sites=(
        (
            Setup("smoke", batch_rollouts=2, num_envs=4),
            (
                ("fit", Crowd(3, 6.0, hosts=1)),
                ("memory", Crowd(6, 12.0)),
            ),
        ),
    ),
    real_actors=(1,),
    rounds=1,
    seconds=3.0,
    memory_seconds=6.0,
    lease_seconds=30.0,
)
