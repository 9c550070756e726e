from dataclasses import replace

import numpy as np
import pytest

from shared.identification.catalogue import (
    command_latency,
    joint_spring,
    torque_saturation,
    tracker_latency,
)
from shared.identification.dataset.types import Dataset
from shared.identification.effect import Candidate
from shared.identification.excitation.arm import mjcf_arm
from shared.identification.excitation.prediction import (
    Prediction,
    able_subject,
    assumed_noise,
    predict,
)
from shared.identification.excitation.programme import Programme, design
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.problem import BLOCK, Problem, Variant
from shared.identification.fitting.space import Space
from shared.identification.noise.floor import Noise, noise_of
from tests.arms import write_arm

EFFECTS = (
    command_latency.EFFECT, joint_spring.EFFECT, torque_saturation.EFFECT, tracker_latency.EFFECT,
)  # fmt: skip


@pytest.fixture(scope="module")
def programme(tmp_path_factory: pytest.TempPathFactory) -> Programme:
    path = write_arm(tmp_path_factory.mktemp("arm"))
    path.write_text(path.read_text().replace('timestep="0.002"', 'timestep="0.005"'))
    return design(mjcf_arm(path, None, "tool", 10.0, None), 40.0, seed=1)


@pytest.fixture(scope="module")
def quiet() -> Noise:
    noise = assumed_noise(3)
    return replace(noise, correlation=np.zeros(9))


@pytest.fixture(scope="module")
def predicted(programme: Programme, quiet: Noise) -> Prediction:
    return predict(programme.predicted, quiet, EFFECTS)


def ratios(prediction: Prediction) -> dict[str, float]:
    return {power.label: power.ratio for outlook in prediction.outlooks for power in outlook.powers}


def visible(prediction: Prediction) -> set[str]:
    powers = [power for outlook in prediction.outlooks for power in outlook.powers]
    return {power.label for power in powers if power.is_visible}


def noisy(dataset: Dataset, noise: Noise, seed: int) -> Dataset:
    """Return recordings whose means over a block of two readings have the noise's deviation."""
    rng = np.random.default_rng(seed)
    assert noise.tracker is not None
    trajectories = []
    for each in dataset.trajectories:
        assert each.tracker is not None
        q = each.q + np.sqrt(2.0) * noise.joints * rng.standard_normal(each.q.shape)
        pose = each.tracker.copy()
        drawn = np.sqrt(2.0) * noise.tracker * rng.standard_normal((len(pose), 6))
        pose[:, :3] += drawn[:, :3]
        half = np.concatenate([np.ones((len(pose), 1)), 0.5 * drawn[:, 3:]], axis=1)
        pose[:, 3:] = _product(half / np.linalg.norm(half, axis=1, keepdims=True), pose[:, 3:])
        trajectories.append(replace(each, q=q, tracker=pose))
    return replace(dataset, trajectories=tuple(trajectories))


def _product(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    w, x, y, z = one.T
    a, b, c, d = other.T
    return np.stack(
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ],
        axis=1,
    )


@pytest.mark.slow
def test_what_is_predicted_is_what_recordings_with_noise_then_say(
    programme: Programme, predicted: Prediction, quiet: Noise
):
    recorded = noisy(programme.predicted, quiet, 3)
    found = ratios(predict(recorded, noise_of(recorded, BLOCK, {}), EFFECTS))
    for label, ratio in ratios(predicted).items():
        if label in visible(predicted):
            assert found[label] == pytest.approx(ratio, rel=0.2), label


def test_a_visible_effect_stands_out_of_the_noise_by_its_ratio(
    programme: Programme, predicted: Prediction, quiet: Noise
):
    """The noise is 1 in each of M numbers: an effect of ratio r leaves r^2 + M of power."""
    kept = replace(
        programme.predicted,
        trajectories=tuple(each for each in programme.predicted.train if not each.repeats),
    )
    subject = able_subject(kept)
    recorded = noisy(kept, quiet, 5)
    problem = Problem(subject, recorded, base_parameters(subject), quiet)
    space = Space(problem)
    zero = np.zeros(space.size)
    residual, jacobian = space.jacobian(zero, problem.of("train"))
    basis = np.linalg.qr(jacobian)[0]
    power = next(
        power for outlook in predicted.outlooks for power in outlook.powers
        if power.effect == "command_latency"
    )  # fmt: skip
    candidate = Candidate(command_latency.EFFECT, "")
    seen = Variant(zero).with_extra(candidate, np.array([power.size]))
    found = problem.vector([seen], problem.of("train"))[0]
    found = np.concatenate([found, np.zeros(space.size)])
    with_it = found - basis @ (basis.T @ found)
    without = residual - basis @ (basis.T @ residual)
    gained = float(with_it @ with_it - without @ without)
    assert gained == pytest.approx(power.ratio**2, rel=0.15)
    # A tenth of noise and effect together, so a ninth of the noise, is at the size for it.
    at_limit = gained * (power.named_from / power.size) ** 2
    assert at_limit == pytest.approx(len(residual) / 9, rel=0.15)


def test_saturation_is_seen_in_a_programme_and_not_in_gentle_motion(
    programme: Programme, predicted: Prediction, quiet: Noise
):
    def saturation(prediction: Prediction) -> tuple[bool, float]:
        found = next(each for each in prediction.outlooks if each.effect == "torque_saturation")
        is_visible = any(power.is_visible for power in found.powers)
        return is_visible, max(power.ratio for power in found.powers)

    assert saturation(predicted)[0]
    arm = programme.arm
    gentle = replace(arm, limits=arm.limits.within(0.05), reach=0.3 * arm.reach)
    motion = design(gentle, 40.0, seed=1)
    assert motion.effort.max() < 0.5
    is_visible, ratio = saturation(predict(motion.predicted, quiet, EFFECTS))
    assert not is_visible
    assert ratio < 0.1
