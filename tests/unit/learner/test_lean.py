"""What takes the place of rsl_rl's parts does the same as they do."""

import pytest
import torch
from rsl_rl.modules import GaussianDistribution
from rsl_rl.storage import RolloutStorage
from tensordict import TensorDict

from services.learner.lean import LeanGaussian, ShuffledStorage, Tanh, make_lean

FIELDS = ("actions", "values", "advantages", "returns", "old_actions_log_prob")


def filled(kind: type[RolloutStorage], rows: int) -> RolloutStorage:
    storage = kind("rl", 1, rows, TensorDict({"policy": torch.zeros(1, 3)}, [1]), [2])
    drawn = torch.Generator().manual_seed(3)

    def some(width: int) -> torch.Tensor:
        return torch.randn(rows, 1, width, generator=drawn)

    storage.observations["policy"] = some(3)
    storage.actions, storage.values, storage.returns = some(2), some(1), some(1)
    storage.actions_log_prob, storage.advantages = some(1), some(1)
    storage.distribution_params = (some(2), some(2))
    return storage


@pytest.mark.parametrize("rows", [24, 27])
def test_the_minibatches_are_rsl_rls(rows: int):
    batches = []
    for kind in (RolloutStorage, ShuffledStorage):
        torch.manual_seed(5)
        batches.append(list(filled(kind, rows).mini_batch_generator(4, 3)))
    theirs, ours = batches
    assert len(ours) == len(theirs) == 12
    for one, other in zip(ours, theirs, strict=True):
        assert torch.equal(one.observations["policy"], other.observations["policy"])
        for field in FIELDS:
            assert torch.equal(getattr(one, field), getattr(other, field)), field
        for mine, yours in zip(
            one.old_distribution_params, other.old_distribution_params, strict=True
        ):
            assert torch.equal(mine, yours)


@pytest.mark.parametrize("init_std", [0.01, 0.4, 5.0])  # below, within and above its range
def test_density_entropy_and_their_gradients_are_rsl_rls(init_std: float):
    means = torch.randn(50, 6)
    outputs = means + torch.randn(50, 6)
    found = []
    for kind in (GaussianDistribution, LeanGaussian):
        gaussian = kind(6, init_std, (0.05, 1.0), "log")
        leaf = means.clone().requires_grad_()
        gaussian.update(leaf)
        density, entropy = gaussian.log_prob(outputs), gaussian.entropy
        (density.mean() + 0.3 * entropy.mean()).backward()
        found.append((density, entropy, leaf.grad, gaussian.log_std_param.grad))
    for ours, theirs in zip(found[1], found[0], strict=True):
        torch.testing.assert_close(ours, theirs)


def test_actions_are_drawn_unless_gradients_are_computed():
    gaussian = LeanGaussian(6, 0.5, (0.05, 1.0), "log")
    gaussian.update(means := torch.zeros(400, 6))
    assert torch.equal(gaussian.sample(), means)
    with torch.no_grad():
        assert float(gaussian.sample().std()) == pytest.approx(0.5, rel=0.1)


def test_the_tangent_and_its_gradient_are_torchs():
    x = torch.cat([torch.linspace(-12.0, 12.0, 2001), torch.tensor([0.0, -0.0, 1e-30, 1e30])])
    found = []
    for layer in (torch.nn.Tanh(), Tanh()):
        leaf = x.clone().requires_grad_()
        y = layer(leaf.view(5, -1).T)  # not contiguous
        y.sum().backward()
        found.append((y, leaf.grad))
    for ours, theirs in zip(found[1], found[0], strict=True):
        torch.testing.assert_close(ours, theirs, atol=2e-7, rtol=1e-6)


def test_a_network_keeps_its_parameters_and_their_names():
    network = torch.nn.Sequential(torch.nn.Linear(3, 4), torch.nn.Tanh(), torch.nn.Linear(4, 1))
    before = {name: value.clone() for name, value in network.state_dict().items()}
    make_lean(network)
    assert isinstance(network[1], Tanh)
    after = network.state_dict()
    assert list(after) == list(before)
    assert all(torch.equal(after[name], before[name]) for name in before)
