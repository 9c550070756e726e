"""The exported policy in onnxruntime, which others use, against ours."""

from typing import Any

import numpy as np
import onnx as library
import onnxruntime
import pytest

from shared.errors import SnapshotError
from shared.messages.training import ACTION_DIM, OBS_DIM
from shared.policy.mlp import GaussianPolicy
from shared.policy.snapshot import Snapshot, pack
from shared.styles import onnx
from tests.unit.policy.making import card, snapshot, weights


def of(activation: Any, hidden: tuple[int, ...] = (64, 64), seed: int = 0) -> Snapshot:
    made = weights(hidden=hidden, activation=activation, seed=seed)
    return pack(card(made), made)


def session(payload: bytes) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    return onnxruntime.InferenceSession(payload, options, providers=["CPUExecutionProvider"])


def observations(made: Snapshot, spread: float, count: int = 500) -> Any:
    """Return float32[count, 27], so many standard deviations about the normaliser's mean."""
    noise = np.random.default_rng(1).standard_normal((count, OBS_DIM)) * spread
    return (made.weights.obs_mean + made.weights.obs_std * noise).astype(np.float32)


@pytest.mark.parametrize("activation", ["tanh", "elu"])
@pytest.mark.parametrize("hidden", [(64, 64), (32,), (16, 8, 4)])
@pytest.mark.parametrize("spread", [1.0, 10.0])
def test_onnxruntime_acts_as_our_network_does(
    activation: str, hidden: tuple[int, ...], spread: float
):
    made = of(activation, hidden)
    obs = observations(made, spread)
    (found,) = session(onnx.build(made)).run(["mean"], {"obs": obs})
    expected = GaussianPolicy(made.weights).mean(obs)
    assert found.dtype == np.float32
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6)


def test_extreme_observations_saturate_alike():
    made = of("tanh")
    run = session(onnx.build(made))
    policy = GaussianPolicy(made.weights)
    ends = np.sign(np.random.default_rng(2).standard_normal((64, OBS_DIM))).astype(np.float32)
    for size in (0.0, 100.0, 1e6, 1e30):
        obs = ends * np.float32(size)
        (found,) = run.run(None, {"obs": obs})
        np.testing.assert_allclose(found, policy.mean(obs), rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("count", [1, 7, 1000])
def test_the_number_of_observations_is_free(count: int):
    made = of("tanh", (8, 4))
    run = session(onnx.build(made))
    (found,) = run.run(None, {"obs": observations(made, 1.0, count)})
    assert found.shape == (count, ACTION_DIM)
    (entry,) = run.get_inputs()
    assert (entry.name, entry.shape, entry.type) == ("obs", ["N", OBS_DIM], "tensor(float)")
    (entry,) = run.get_outputs()
    assert (entry.name, entry.shape) == ("mean", ["N", ACTION_DIM])


def test_the_normaliser_is_inside_with_its_epsilon():
    """A feature that never varied in training still divides by 0.01, as rsl_rl does."""
    made = weights()
    made.obs_std[:] = 0.0
    exported = onnx.build(pack(card(made), made))
    obs = made.obs_mean + np.float32(0.01) * np.eye(OBS_DIM, dtype=np.float32)
    (found,) = session(exported).run(None, {"obs": obs})
    hidden = np.eye(OBS_DIM)
    for weight, bias in made.layers[:-1]:
        hidden = np.tanh(hidden @ weight.T + bias)
    expected = hidden @ made.layers[-1][0].T + made.layers[-1][1]
    np.testing.assert_allclose(found, expected, atol=2e-6)


def test_the_file_says_what_it_is_and_fits():
    made = snapshot(seed=4)
    facts = onnx.metadata(onnx.build(made))
    assert facts["snapshot_sha256"] == made.digest
    assert facts["observation_schema"] == made.card.observation_schema
    assert facts["action_schema"] == made.card.action_schema
    assert facts["normaliser"] == made.card.normaliser
    assert float(facts["control_timestep_s"]) == made.card.control_timestep
    assert float(facts["offset_bound_m"]) == made.card.offset_bound_m
    std = [float(value) for value in facts["exploration_std"].split(",")]
    np.testing.assert_allclose(std, np.exp(made.weights.log_std), rtol=1e-6)
    assert session(onnx.build(made)).get_modelmeta().custom_metadata_map == facts


def test_the_file_is_sound_and_the_same_each_time():
    made = snapshot()
    payload = onnx.build(made)
    library.checker.check_model(library.load_from_string(payload), full_check=True)
    assert payload == onnx.build(made)
    assert payload != onnx.build(snapshot(seed=1))


def test_a_graph_that_computes_something_else_is_not_handed_out(monkeypatch: pytest.MonkeyPatch):
    made = of("tanh")
    assert onnx.round_trip_error(onnx.build(made), made.weights) < 1e-6
    other = onnx.build(of("tanh", seed=1))
    assert onnx.round_trip_error(other, made.weights) > 0.01
    monkeypatch.setitem(onnx.OPERATORS, "tanh", "Elu")
    with pytest.raises(SnapshotError, match="differs from the policy by"):
        onnx.build(made)
