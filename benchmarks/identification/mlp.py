"""A net that learns what the base fit leaves over, of what the arm does; it names nothing."""

import time
import warnings
from typing import Any

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor

from benchmarks.identification.base_only import share_removed
from shared.identification.fitting.problem import BLOCK
from shared.identification.search.searched import Search
from shared.sim.plant.signals import sampled

_LAGS = (0.0, 0.05, 0.1)
"""Of the command before now, that the net also sees (s)."""


def mlp(found: Search, rng: np.random.Generator) -> dict[str, Any]:
    """Return the share of the explainable held-out loss that it removes."""
    begin = time.process_time()
    problem = found.problem
    train, test = _table(found, problem.of("train")), _table(found, problem.of("test"))
    centre, scale = train[0].mean(axis=0), train[0].std(axis=0) + 1e-9
    height = float(np.sqrt(np.mean(train[1] ** 2)))
    net = MLPRegressor(
        hidden_layer_sizes=(64, 64), alpha=1e-2, early_stopping=True, max_iter=200,
        random_state=int(rng.integers(2**31)),
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        net.fit((train[0] - centre) / scale, train[1] / height)
    guessed = height * net.predict((test[0] - centre) / scale)
    loss = float(np.mean((test[1] - guessed) ** 2))
    return {
        "name": "",
        "share_removed": share_removed(found, loss),
        "loss": loss,
        "cpu_s": time.process_time() - begin,
    }


def _table(found: Search, segments: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return float64[B, F] of what the model does, and float64[B, C] of what it leaves over."""
    problem, base = found.problem, found.base
    variant = base.variant
    reports = problem.reports([variant], segments)[0]
    features, wanted = [], []
    for index, report in zip(segments, reports, strict=True):
        residual = problem.floors(report, index)
        recorded = problem.segments[index].recorded
        at = recorded.joints_at[0] + BLOCK * (np.arange(len(residual)) + 0.5)
        q = sampled(recorded.joints_at, report.q, at)
        qd = np.gradient(q, at, axis=0)
        commands = [recorded.command.held(at - lag) for lag in _LAGS]
        features.append(np.concatenate([q, qd, np.gradient(qd, at, axis=0), *commands], axis=1))
        wanted.append(residual)
    return np.concatenate(features), np.concatenate(wanted)
