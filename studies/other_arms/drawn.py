"""Arms that nobody chose: links that hang, drawn at random, under servos or under torques."""

from typing import Final

import numpy as np

from shared.identification.dataset.types import Float64
from shared.sim.plant.plant import Control
from studies.other_arms.arms import ARMS, Arm, Link, Numbers

DRAWN: Final[dict[str, Control]] = {"hanging": "position", "hanging_torques": "torque"}
"""What commands are, by name."""
_COUNTS: Final = (2, 2, 2, 3, 3, 3, 4, 4, 6)
_GRAVITY: Final = 9.81


def arm_named(name: str, seed: int) -> Arm:
    """Return one of the three arms, or one that is drawn."""
    return drawn(DRAWN[name], seed) if name in DRAWN else ARMS[name]


def drawn(control: Control, seed: int) -> Arm:
    """Return an arm of two to six hinges.

    Half of those of three or more turn about the vertical first, those of six roll their hand last.
    Rotors are a fifth to four fifths of what they move; servos would swing at 3 to 5 Hz, half as
    damped as they may be without overshoot; friction is a fiftieth to a seventeenth of the largest
    weight.

    Args:
        control: what commands are.
        seed: of everything random.
    """
    rng = np.random.default_rng([seed, len(control)])
    count = int(rng.choice(_COUNTS))
    turns = count > 2 and bool(rng.integers(2))
    lengths = rng.uniform(0.12, 0.35, count)
    masses = rng.uniform(0.9, 1.5, count) * 0.6 ** np.arange(count)
    if turns:
        lengths[0] = 0.05
    inertia, weight = _felt(lengths, masses)
    rotor = inertia * rng.uniform(0.2, 0.8, count)
    swift = rng.uniform(18.0, 30.0)
    kp = (inertia + rotor) * swift**2 * rng.uniform(0.8, 1.2, count)
    kv = (inertia + rotor) * swift * rng.uniform(0.8, 1.2, count)
    friction = rng.uniform(0.02, 0.06, count) * np.maximum(weight, 2.0)
    swing = rng.uniform(0.3, 0.7, count)
    home = rng.uniform(0.2, 0.9, count) * (-1.0) ** np.arange(count)
    return Arm(
        links=tuple(
            Link(
                f"j{index}",
                "0 0 1" if turns and index == 0 else "1 0 0" if index == 5 else "0 1 0",
                f"0 0 {-lengths[index - 1] if index else 1.0:.4f}",
                f"0 0 {-lengths[index]:.4f}",
                round(float(masses[index]), 4),
            )
            for index in range(count)
        ),
        control=control,
        numbers=Numbers(rotor, 0.05 * kv, friction, kp, kv),
        limit=2.0 * (weight + (inertia + rotor) * swing * 40.0),
        home=home,
        swing=swing,
        period=float(rng.choice([0.002, 0.004] if control == "torque" else [0.005, 0.01])),
        noise=float(rng.choice([5e-5, 1.5e-4, 3e-4])),
        push=2e-5,
    )


def _felt(lengths: Float64, masses: Float64) -> tuple[Float64, Float64]:
    """Return what each joint feels of a straight arm, float64[J]: inertia and largest weight."""
    inertia, weight = np.zeros(len(lengths)), np.zeros(len(lengths))
    for joint in range(len(lengths)):
        begins = np.cumsum(np.r_[0.0, lengths[joint:-1]])
        centres, rods = begins + 0.5 * lengths[joint:], lengths[joint:]
        inertia[joint] = np.sum(masses[joint:] * (centres**2 + rods**2 / 12.0)) + 0.002
        weight[joint] = _GRAVITY * np.sum(masses[joint:] * centres)
    return inertia, weight
