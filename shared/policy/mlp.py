"""The policy network in numpy: what actors and robots run, without torch.

It is rsl_rl's ``MLPModel`` with a state-independent Gaussian: observations normalised by
``(x - mean) / (std + 0.01)``, hidden layers with one activation, a linear mean.
"""

import dataclasses
import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Activation = Literal["tanh", "elu"]

NORMALISER_EPSILON = np.float32(0.01)
"""rsl_rl's ``EmpiricalNormalization`` adds this to the standard deviation."""


@dataclasses.dataclass(frozen=True)
class PolicyWeights:
    """Everything the network needs; arrays are float32 and are not written to."""

    obs_mean: Floats
    """float32[obs_dim]."""
    obs_std: Floats
    """float32[obs_dim]."""
    layers: tuple[tuple[Floats, Floats], ...]
    """Weight float32[out, in] and bias float32[out] of each layer, the last one the mean."""
    log_std: Floats
    """float32[action_dim]."""
    activation: Activation


class GaussianPolicy:
    """A policy ready to act on batches."""

    def __init__(self, weights: PolicyWeights) -> None:
        self.weights = weights
        self.std: Floats = np.exp(weights.log_std)
        """float32[action_dim]."""
        scale = np.float32(1.0) / (weights.obs_std + NORMALISER_EPSILON)
        self._layers = [(np.ascontiguousarray(w.T), b) for w, b in weights.layers]
        self._layers[0][0][:] *= scale[:, None]
        self._numbers = (weights.obs_mean, weights.layers[-1][1], self.std)
        self._rows: tuple[Floats, ...] = ()
        self._num_rows = -1
        self._log_normaliser = float(np.sum(weights.log_std, dtype=np.float64)) + (
            0.5 * len(weights.log_std) * math.log(2.0 * math.pi)
        )

    def mean(self, obs: Floats) -> Floats:
        """Return the mean action for each observation.

        Args:
            obs: float32[N, obs_dim].

        Returns:
            float32[N, action_dim].
        """
        obs_mean, last_bias, _ = self._repeated(len(obs))
        hidden: Floats = np.subtract(obs, obs_mean)
        *body, (last_weight, _) = self._layers
        for weight, bias in body:
            hidden = hidden @ weight
            hidden += bias
            if self.weights.activation == "tanh":
                np.tanh(hidden, out=hidden)
            else:
                below: Floats = np.expm1(np.minimum(hidden, np.float32(0.0)))
                np.maximum(hidden, np.float32(0.0), out=hidden)
                hidden += below
        mean: Floats = hidden @ last_weight
        mean += last_bias
        return mean

    def sample(self, mean: Floats, noise: Floats) -> Floats:
        """Return mean + std * noise.

        Args:
            mean: float32[N, action_dim].
            noise: float32[N, action_dim], standard normal.
        """
        _, _, std = self._repeated(len(mean))
        actions: Floats = np.multiply(std, noise)
        actions += mean
        return actions

    def log_prob(self, noise: Floats) -> Floats:
        """Return the log density of the actions drawn with this standard normal noise.

        Args:
            noise: float32[..., action_dim].

        Returns:
            float32[...].
        """
        squares = np.einsum("...i,...i->...", noise, noise)
        return np.float32(-0.5) * squares - np.float32(self._log_normaliser)

    def _repeated(self, rows: int) -> tuple[Floats, ...]:
        """Return mean of the observations, last bias and deviation, once for each row.

        Rows of a few numbers that numpy has to repeat take it three times as long to add.
        """
        if self._num_rows != rows:
            self._rows = tuple(np.tile(numbers, (rows, 1)) for numbers in self._numbers)
            self._num_rows = rows
        return self._rows
