"""Our way into rsl_rl's PPO equals rsl_rl's own; the policy that leaves it is the one trained."""

from typing import Any

import msgspec
import numpy as np
import pytest
import torch
from rsl_rl.env import VecEnv
from rsl_rl.runners import OnPolicyRunner
from rsl_rl.storage import RolloutStorage
from tensordict import TensorDict

from benchmarks.peer_loops.rsl_rl_runner import runner_config
from services.learner.ppo import PolicyOptimiser
from shared.errors import CheckpointError, ConfigError
from shared.messages.training import ACTION_DIM, OBS_DIM, Rollout
from shared.policy.mlp import GaussianPolicy
from tests.unit.learner.making import SMALL, rollout

TORCH = torch.float32


def observations(obs: torch.Tensor) -> TensorDict:
    return TensorDict({"policy": obs}, batch_size=obs.shape[:-1])


class Recorded(VecEnv):
    """An environment of rsl_rl that says what was recorded beforehand, and writes actions down."""

    def __init__(self, obs: torch.Tensor, rewards: torch.Tensor) -> None:
        self.num_envs = obs.shape[1]
        self.num_actions = ACTION_DIM
        self.max_episode_length = 10**6
        self.episode_length_buf = torch.zeros(self.num_envs, dtype=torch.long)
        self.device = "cpu"
        self.cfg: dict[str, Any] = {}
        self.obs, self.rewards = obs, rewards
        self.actions: list[torch.Tensor] = []

    def get_observations(self) -> TensorDict:
        return observations(self.obs[len(self.actions)])

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict]:
        self.actions.append(actions.clone())
        reward = self.rewards[len(self.actions) - 1]
        return self.get_observations(), reward, torch.zeros(self.num_envs), {}


def as_rollout(obs: torch.Tensor, rewards: torch.Tensor, storage: RolloutStorage) -> Rollout:
    """What an actor would have sent of the same steps."""
    assert storage.distribution_params is not None
    means, stds = storage.distribution_params
    plain = rollout(0, steps=len(rewards), worlds=rewards.shape[1])
    return msgspec.structs.replace(
        plain,
        obs=obs[:-1].numpy(),
        last_obs=obs[-1].numpy(),
        actions=storage.actions.numpy().copy(),
        means=means.numpy().copy(),
        stds=stds[0, 0].numpy().copy(),
        log_probs=storage.actions_log_prob.squeeze(-1).numpy().copy(),
        rewards=rewards.numpy(),
    )


def assert_same(ours: dict[str, torch.Tensor], theirs: dict[str, torch.Tensor]) -> None:
    assert ours.keys() == theirs.keys()
    for name, value in ours.items():
        if name != "random_state":  # ours draws once more, to measure the update
            torch.testing.assert_close(value, theirs[name], atol=1e-6, rtol=1e-6, msg=name)


@pytest.mark.parametrize("activation", ["tanh", "elu"])
def test_three_updates_of_rsl_rls_own_runner_give_the_same_weights_and_moments(
    activation: Any, monkeypatch: pytest.MonkeyPatch
):
    cfg = msgspec.structs.replace(SMALL, activation=activation)
    steps, worlds = 10, 6
    ours, theirs = PolicyOptimiser(cfg, 5), PolicyOptimiser(cfg, 5)
    generator = torch.Generator().manual_seed(1)
    for number in range(3):
        obs = torch.randn(steps + 1, worlds, OBS_DIM, generator=generator) * 1.5 + 0.3
        rewards = torch.randn(steps, worlds, generator=generator)
        runner = OnPolicyRunner(
            Recorded(obs, rewards), runner_config(cfg, steps), log_dir=None, device="cpu"
        )
        storage = runner.alg.storage
        # The runner's algorithm continues from ours; its own update draws from the same state.
        runner.alg.actor.load_state_dict(theirs._algorithm.actor.state_dict())
        runner.alg.critic.load_state_dict(theirs._algorithm.critic.state_dict())
        runner.alg.optimizer.load_state_dict(theirs._algorithm.optimizer.state_dict())
        update = runner.alg.update
        recorded: list[Rollout] = []

        def with_our_random_state(
            update: Any = update, storage: Any = storage, recorded: Any = recorded,
            obs: Any = obs, rewards: Any = rewards,
        ) -> Any:  # fmt: skip
            recorded.append(as_rollout(obs, rewards, storage))
            torch.set_rng_state(theirs._random.host)
            return update()

        monkeypatch.setattr(runner.alg, "update", with_our_random_state)
        torch.manual_seed(number)
        runner.learn(1)
        theirs._algorithm.actor.load_state_dict(runner.alg.actor.state_dict())
        theirs._algorithm.critic.load_state_dict(runner.alg.critic.state_dict())
        theirs._algorithm.optimizer.load_state_dict(runner.alg.optimizer.state_dict())

        stats = ours.update(recorded)
        assert stats.samples == steps * worlds
        assert_same(ours.state(), theirs.state())
        theirs._random.host = ours._random.host


def test_act_step_returns_and_update_by_hand_give_the_same_weights():
    steps, worlds = 12, 5
    ours, theirs = PolicyOptimiser(SMALL, 5), PolicyOptimiser(SMALL, 5)
    warm = [rollout(9)]
    for optimiser in (ours, theirs):
        optimiser.warm_up(warm)
    algorithm = theirs._algorithm
    generator = torch.Generator().manual_seed(2)
    obs = torch.randn(steps + 1, worlds, OBS_DIM, generator=generator)
    rewards = torch.randn(steps, worlds, generator=generator)
    storage = RolloutStorage("rl", worlds, steps, observations(obs[0]), [ACTION_DIM])
    algorithm.storage = storage
    with torch.no_grad():
        for step in range(steps):
            algorithm.act(observations(obs[step]))
            algorithm.process_env_step(
                observations(obs[step + 1]), rewards[step], torch.zeros(worlds), {}
            )
        algorithm.compute_returns(observations(obs[-1]))
    recorded = as_rollout(obs, rewards, storage)
    torch.set_rng_state(theirs._random.host)
    losses = algorithm.update()
    stats = ours.update([recorded])
    assert_same(ours.state(), theirs.state())
    assert stats.value_loss == pytest.approx(losses["value"], rel=1e-5)
    assert stats.surrogate_loss == pytest.approx(losses["surrogate"], rel=1e-4, abs=1e-6)
    assert stats.entropy == pytest.approx(losses["entropy"], rel=1e-5)


@pytest.mark.parametrize("activation", ["tanh", "elu"])
def test_the_numpy_policy_equals_rsl_rls_model_after_every_update(activation: Any):
    optimiser = PolicyOptimiser(msgspec.structs.replace(SMALL, activation=activation), 1)
    optimiser.warm_up([rollout(100)])
    for number in range(4):
        acting = GaussianPolicy(optimiser.weights())
        sample = rollout(number, policy=optimiser.weights())
        flat = torch.from_numpy(sample.obs.reshape(-1, OBS_DIM))
        actor = optimiser._algorithm.actor
        with torch.no_grad():
            actor(observations(flat), stochastic_output=True)
            mean, std = (p.numpy() for p in actor.output_distribution_params)
            actions = torch.from_numpy(sample.actions.reshape(-1, ACTION_DIM))
            log_prob = actor.get_output_log_prob(actions).numpy()
        np.testing.assert_allclose(acting.mean(flat.numpy()), mean, atol=1e-6)
        np.testing.assert_allclose(acting.std, std[0], atol=1e-6)
        np.testing.assert_allclose(sample.log_probs.ravel(), log_prob, atol=2e-6, rtol=2e-6)
        optimiser.update([sample])


def test_an_optimiser_restored_from_its_state_updates_bit_for_bit_alike():
    cfg = SMALL
    whole = PolicyOptimiser(cfg, 1)
    whole.warm_up([rollout(100)])
    whole.update([rollout(0)])
    state = whole.state()
    other = PolicyOptimiser(cfg, 2)
    other.restore(state)
    for optimiser in (whole, other):
        optimiser.update([rollout(1), rollout(2)])
    ours, theirs = whole.state(), other.state()
    assert ours.keys() == theirs.keys()
    assert any(name.startswith("adam.") for name in ours)
    for name, value in ours.items():
        assert torch.equal(value, theirs[name]), name


def test_a_state_is_a_copy():
    optimiser = PolicyOptimiser(SMALL, 1)
    optimiser.update([rollout(0)])
    state = {name: value.clone() for name, value in optimiser.state().items()}
    kept = optimiser.state()
    optimiser.update([rollout(1)])
    for name, value in kept.items():
        assert torch.equal(value, state[name]), name


def test_updates_leave_torchs_own_random_state_alone():
    torch.manual_seed(3)
    before = torch.get_rng_state()
    optimiser = PolicyOptimiser(SMALL, 1)
    optimiser.update([rollout(0)])
    assert torch.equal(torch.get_rng_state(), before)


def test_the_same_seed_gives_the_same_weights_and_another_gives_others():
    one, same, other = (PolicyOptimiser(SMALL, seed).state() for seed in (1, 1, 2))
    assert all(torch.equal(one[name], same[name]) for name in one)
    assert not torch.equal(one["critic.mlp.0.weight"], other["critic.mlp.0.weight"])


def test_warming_up_moves_the_normaliser_and_nothing_else():
    optimiser = PolicyOptimiser(SMALL, 1)
    before = optimiser.state()
    sample = rollout(0)
    optimiser.warm_up([sample])
    after = optimiser.state()
    for name, value in before.items():
        assert torch.equal(value, after[name]) != ("obs_normalizer" in name), name
    mean = optimiser.weights().obs_mean
    np.testing.assert_allclose(mean, sample.obs.reshape(-1, OBS_DIM).mean(axis=0), atol=1e-5)


def test_several_rollouts_of_different_lengths_are_one_batch():
    """The update sees the same rows, whether they came in one rollout or in two."""
    whole = rollout(0, worlds=8)
    fields = ("obs", "actions", "means", "log_probs", "rewards")
    flat = {name: getattr(whole, name) for name in fields}

    def part(worlds: slice) -> Rollout:
        return msgspec.structs.replace(
            whole,
            **{name: value[:, worlds] for name, value in flat.items()},
            last_obs=whole.last_obs[worlds],
            bouts=whole.bouts[worlds],
            first_step=whole.first_step[worlds],
            truncated=whole.truncated[worlds],
        )

    cfg = msgspec.structs.replace(SMALL, epochs=1, minibatches=1)  # the order plays no part
    one, two = PolicyOptimiser(cfg, 1), PolicyOptimiser(cfg, 1)
    stats = one.update([whole]), two.update([part(slice(0, 3)), part(slice(3, 8))])
    assert stats[0].samples == stats[1].samples
    assert stats[0].explained_variance == pytest.approx(stats[1].explained_variance, abs=1e-5)
    np.testing.assert_allclose(one.weights().obs_mean, two.weights().obs_mean, atol=1e-6)
    np.testing.assert_allclose(one.weights().layers[0][0], two.weights().layers[0][0], atol=1e-5)


def test_the_deviation_stays_within_its_range_so_that_it_can_come_back():
    cfg = msgspec.structs.replace(SMALL, learning_rate=0.5, minimum_std=0.5, maximum_std=0.7)
    optimiser = PolicyOptimiser(cfg, 1)
    for number in range(3):
        optimiser.update([rollout(number)])
        std = np.exp(optimiser.weights().log_std)
        assert (std >= 0.5 - 1e-6).all()
        assert (std <= 0.7 + 1e-6).all()


def test_the_statistics_are_those_of_the_batch():
    optimiser = PolicyOptimiser(SMALL, 1)
    samples = [rollout(0), rollout(1)]
    stats = optimiser.update(samples)
    assert stats.samples == 128
    assert stats.reward_mean == pytest.approx(
        float(np.mean([sample.rewards.mean() for sample in samples])), abs=1e-6
    )
    assert 0.0 <= stats.clip_fraction <= 1.0
    assert stats.approx_kl >= 0.0
    assert stats.action_std == pytest.approx(float(np.exp(optimiser.weights().log_std).mean()))


def test_a_state_of_another_network_is_refused_by_name():
    state = PolicyOptimiser(SMALL, 1).state()
    wider = PolicyOptimiser(msgspec.structs.replace(SMALL, hidden_dims=(8, 8)), 1)
    with pytest.raises(CheckpointError, match=r"does not fit this network: .*mlp\.0\.weight"):
        wider.restore(state)
    del state["random_state"]
    with pytest.raises(CheckpointError, match="random_state"):
        PolicyOptimiser(SMALL, 1).restore(state)


def test_a_device_that_is_not_there_is_named_with_those_that_are():
    if torch.cuda.is_available():
        pytest.skip("there is a graphics card")
    with pytest.raises(ConfigError, match=r"learner.device is 'cuda:3'.*here are cpu"):
        PolicyOptimiser(msgspec.structs.replace(SMALL, device="cuda:3"), seed=1)
    with pytest.raises(ConfigError, match=r"learner.device is 'gpu'"):
        PolicyOptimiser(msgspec.structs.replace(SMALL, device="gpu"), seed=1)


@pytest.mark.gpu
def test_an_update_on_a_card_is_the_processors_but_for_rounding_and_resumes_to_the_bit():
    if not torch.cuda.is_available():
        pytest.skip("no graphics card, or a torch without CUDA")
    card = msgspec.structs.replace(SMALL, device="cuda", minibatches=1)
    host = msgspec.structs.replace(SMALL, minibatches=1)  # one minibatch: no order to draw
    rollouts = [rollout(3)]
    ours, theirs = PolicyOptimiser(card, seed=1), PolicyOptimiser(host, seed=1)
    theirs.restore(ours.state())
    ours.update(rollouts)
    theirs.update(rollouts)
    for one, other in zip(ours.weights().layers, theirs.weights().layers, strict=True):
        np.testing.assert_allclose(one[0], other[0], atol=1e-4)
    kept = ours.state()
    ours.update(rollouts)
    again = PolicyOptimiser(card, seed=2)
    again.restore(kept)
    again.update(rollouts)
    for name, value in ours.state().items():
        assert torch.equal(value, again.state()[name]), name
