"""The numpy policy by hand arithmetic."""

import math

import numpy as np
import pytest

from shared.errors import SnapshotError
from shared.policy.mlp import Activation, GaussianPolicy
from shared.policy.players import SnapshotPlayer, StaticPlayer, scripted_player
from tests.unit.policy.making import weights


@pytest.mark.parametrize("activation", ["tanh", "elu"])
def test_the_mean_is_the_network_worked_out_neuron_by_neuron(activation: Activation):
    made = weights((5, 3), activation)
    obs = np.random.default_rng(1).normal(size=(2, 27)).astype(np.float32)
    found = GaussianPolicy(made).mean(obs)
    for row in range(2):
        values = [
            (float(o) - float(m)) / (float(s) + 0.01)
            for o, m, s in zip(obs[row], made.obs_mean, made.obs_std, strict=True)
        ]
        for index, (weight, bias) in enumerate(made.layers):
            sums = [
                float(b) + sum(float(w) * v for w, v in zip(line, values, strict=True))
                for line, b in zip(weight, bias, strict=True)
            ]
            last = index == len(made.layers) - 1
            if last:
                values = sums
            elif activation == "tanh":
                values = [math.tanh(x) for x in sums]
            else:
                values = [x if x > 0 else math.expm1(x) for x in sums]
        np.testing.assert_allclose(found[row], values, atol=1e-5)
    assert found.dtype == np.float32


def test_the_observations_are_left_as_they_were():
    obs = np.ones((3, 27), np.float32)
    GaussianPolicy(weights()).mean(obs)
    assert (obs == 1).all()


def test_the_log_probability_is_that_of_independent_gaussians():
    policy = GaussianPolicy(weights())
    generator = np.random.default_rng(2)
    mean = generator.normal(size=(4, 6)).astype(np.float32)
    noise = generator.normal(size=(4, 6)).astype(np.float32)
    actions = policy.sample(mean, noise)
    for row in range(4):
        expected = sum(
            -0.5 * ((a - m) / s) ** 2 - math.log(s) - 0.5 * math.log(2 * math.pi)
            for a, m, s in zip(
                actions[row].tolist(), mean[row].tolist(), policy.std.tolist(), strict=True
            )
        )
        assert float(policy.log_prob(noise)[row]) == pytest.approx(expected, abs=1e-4)


def test_a_frozen_player_takes_the_mean_or_samples_around_it():
    policy = GaussianPolicy(weights())
    obs = np.ones((2, 27), np.float32)
    generator = np.random.default_rng(0)
    mean = SnapshotPlayer(policy, stochastic=False).act(obs, generator)
    np.testing.assert_array_equal(mean, policy.mean(obs))
    noise = np.random.default_rng(0).standard_normal((2, 6), np.float32)
    sampled = SnapshotPlayer(policy, stochastic=True).act(obs, generator)
    np.testing.assert_array_equal(sampled, policy.mean(obs) + policy.std * noise)


def test_the_static_player_asks_for_nothing():
    player = scripted_player("scripted:static")
    assert isinstance(player, StaticPlayer)
    acts = player.act(np.ones((3, 27), np.float32), np.random.default_rng(0))
    assert acts.shape == (3, 6)
    assert acts.dtype == np.float32
    assert not acts.any()


@pytest.mark.parametrize("reference", ["scripted:", "scripted:ghost", "static", ""])
def test_a_scripted_player_that_is_none_is_refused_with_those_there_are(reference: str):
    with pytest.raises(SnapshotError, match=r"scripted players: scripted:guard, .*scripted:static"):
        scripted_player(reference)
