"""Small real policies and snapshots for tests."""

import itertools
from typing import Any

import msgspec
import numpy as np

from shared.messages.training import ACTION_DIM, OBS_DIM
from shared.policy.action import ACTION_SCHEMA
from shared.policy.mlp import Activation, PolicyWeights
from shared.policy.observation import OBSERVATION_SCHEMA
from shared.policy.snapshot import Card, Fit, Snapshot, normaliser_hash, pack

FIT = Fit(control_timestep=0.01, offset_bound_m=0.0375, offset_bound_rad=0.06, model="m" * 64)


def weights(
    hidden: tuple[int, ...] = (8, 4), activation: Activation = "tanh", seed: int = 0
) -> PolicyWeights:
    generator = np.random.default_rng(seed)
    sizes = [OBS_DIM, *hidden, ACTION_DIM]
    return PolicyWeights(
        obs_mean=generator.normal(size=OBS_DIM).astype(np.float32),
        obs_std=generator.uniform(0.1, 2.0, OBS_DIM).astype(np.float32),
        layers=tuple(
            (
                generator.normal(size=(outputs, inputs)).astype(np.float32) / np.float32(inputs),
                generator.normal(size=outputs).astype(np.float32),
            )
            for inputs, outputs in itertools.pairwise(sizes)
        ),
        log_std=generator.uniform(-1.0, 0.0, ACTION_DIM).astype(np.float32),
        activation=activation,
    )


def card(of: PolicyWeights, **changes: Any) -> Card:
    plain = Card(
        agent="antagonist",
        policy_version=3,
        stage=0,
        run="test",
        seed=1,
        total_samples=1000,
        observation_schema=OBSERVATION_SCHEMA,
        action_schema=ACTION_SCHEMA,
        normaliser=normaliser_hash(of.obs_mean, of.obs_std),
        control_timestep=0.01,
        offset_bound_m=0.0375,
        offset_bound_rad=0.06,
        model="m" * 64,
        activation=of.activation,
        hidden_dims=tuple(len(bias) for _, bias in of.layers[:-1]),
    )
    return msgspec.structs.replace(plain, **changes)


def snapshot(seed: int = 0, **changes: Any) -> Snapshot:
    made = weights(seed=seed)
    return pack(card(made, **changes), made)
