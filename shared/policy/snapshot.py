"""The policy artifact: one safetensors file that says what it fits, named by its content hash.

The file has one metadata entry, ``card``, a JSON object with sorted keys, so that the same policy
is always the same bytes. A reader checks the card before it looks at a weight.
"""

import dataclasses
import hashlib
import itertools
import json
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load, save

from shared.errors import SnapshotError
from shared.messages.training import ACTION_DIM, OBS_DIM, Agent
from shared.policy.action import ACTION_SCHEMA, ActionConfig
from shared.policy.mlp import Activation, PolicyWeights
from shared.policy.observation import OBSERVATION_SCHEMA
from shared.policy.schema import schema_hash

SCHEMA = 1
MAX_BYTES = 4 * 1024 * 1024
_MAX_HEADER = 64 * 1024
_MAX_LOG_STD = 10.0
_REFERENCE_PREFIX = "sha256:"
_UNDECODABLE = (msgspec.MsgspecError, UnicodeDecodeError, RecursionError)
"""What JSON from outside may raise."""


class Card(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a snapshot says of itself."""

    schema: int = SCHEMA
    agent: Agent
    policy_version: int
    stage: int
    run: str
    seed: int
    total_samples: int
    observation_schema: str
    action_schema: str
    normaliser: str
    """Hash of the normaliser's numbers."""
    control_timestep: float
    """(s)."""
    offset_bound_m: float
    offset_bound_rad: float
    model: str
    """Hash of the simulator model it was trained in."""
    activation: Activation
    hidden_dims: tuple[int, ...]


class Fit(msgspec.Struct, frozen=True, kw_only=True):
    """What a process needs a snapshot to be made for."""

    control_timestep: float
    offset_bound_m: float
    offset_bound_rad: float
    model: str | None = None
    """None accepts a policy trained in any simulator model."""

    @staticmethod
    def of(action: ActionConfig, control_timestep: float, model: str | None) -> "Fit":
        """Return the fit of a process with this action decoder, control period and model."""
        return Fit(
            control_timestep=control_timestep,
            offset_bound_m=action.offset_bound_m,
            offset_bound_rad=action.offset_bound_rad,
            model=model,
        )


@dataclasses.dataclass(frozen=True)
class Snapshot:
    """An immutable policy: card, weights, and the file they make."""

    card: Card
    weights: PolicyWeights
    payload: bytes
    digest: str
    """SHA-256 of the file, 64 hex digits."""

    @property
    def reference(self) -> str:
        """Return the player reference of this snapshot."""
        return reference_of(self.digest)

    def check_fits(self, fit: Fit) -> None:
        """Refuse a snapshot made for something else.

        Raises:
            SnapshotError: names the field, what it is and what it must be.
        """
        wanted: dict[str, object] = {
            "observation_schema": OBSERVATION_SCHEMA,
            "action_schema": ACTION_SCHEMA,
            "control_timestep": fit.control_timestep,
            "offset_bound_m": fit.offset_bound_m,
            "offset_bound_rad": fit.offset_bound_rad,
        }
        if fit.model is not None:
            wanted["model"] = fit.model
        for field, value in wanted.items():
            if (found := getattr(self.card, field)) != value:
                raise SnapshotError(
                    f"snapshot {self.digest[:12]} does not fit here: its {field} is {found}, "
                    f"this process needs {value}"
                )


def normaliser_hash(obs_mean: NDArray[np.float32], obs_std: NDArray[np.float32]) -> str:
    """Return 16 hex digits that stand for a normaliser's numbers."""
    numbers = (obs_mean, obs_std)
    return schema_hash([values.astype("<f4").tobytes().hex() for values in numbers])


def reference_of(digest: str) -> str:
    """Return the player reference of a content hash."""
    return _REFERENCE_PREFIX + digest


def digest_of(reference: str) -> str:
    """Return the content hash in a snapshot's player reference.

    Raises:
        SnapshotError: if it is not ``sha256:`` and 64 hex digits.
    """
    digest = reference.removeprefix(_REFERENCE_PREFIX)
    if not reference.startswith(_REFERENCE_PREFIX) or len(digest) != 64:
        raise SnapshotError(f"{reference!r} is no snapshot; expected sha256:<64 hex digits>")
    if not set(digest) <= set("0123456789abcdef"):
        raise SnapshotError(f"{reference!r} is no snapshot; expected lower-case hex digits")
    return digest


def pack(card: Card, weights: PolicyWeights) -> Snapshot:
    """Return the snapshot that holds these weights."""
    tensors: dict[str, NDArray[np.float32]] = {
        "normaliser.mean": weights.obs_mean,
        "normaliser.std": weights.obs_std,
        "log_std": weights.log_std,
    }
    for index, (weight, bias) in enumerate(weights.layers):
        tensors[f"layers.{index}.weight"] = weight
        tensors[f"layers.{index}.bias"] = bias
    tensors = {name: np.ascontiguousarray(value, np.float32) for name, value in tensors.items()}
    text = json.dumps(msgspec.to_builtins(card), sort_keys=True)
    payload = save(tensors, metadata={"card": text})
    return Snapshot(card, weights, payload, hashlib.sha256(payload).hexdigest())


def unpack(payload: bytes, digest: str | None = None) -> Snapshot:
    """Return the snapshot in a file.

    Args:
        payload: the file.
        digest: the content hash it must have, when known.

    Raises:
        SnapshotError: too large, another hash, not safetensors, wrong schema, a missing field, a
            tensor of the wrong shape or with a number that is not finite; names which.
    """
    if len(payload) > MAX_BYTES:
        raise SnapshotError(f"snapshot of {len(payload)} bytes is over the limit of {MAX_BYTES}")
    found = hashlib.sha256(payload).hexdigest()
    if digest is not None and found != digest:
        raise SnapshotError(f"snapshot is damaged: its hash is {found[:12]}, not {digest[:12]}")
    card = _read_card(payload)
    try:
        tensors = load(payload)
    except (SafetensorError, ValueError, KeyError, TypeError) as error:
        raise SnapshotError(f"snapshot is unreadable: {error}") from None
    return Snapshot(card, _read_weights(card, tensors), payload, found)


def _read_card(payload: bytes) -> Card:
    """Return the card in a safetensors header."""
    length = int.from_bytes(payload[:8], "little")
    if len(payload) < 8 or length > min(_MAX_HEADER, len(payload) - 8):
        raise SnapshotError("snapshot is unreadable: not a safetensors file, or cut short")
    try:
        header = msgspec.json.decode(payload[8 : 8 + length], type=dict[str, Any])
        text = header["__metadata__"]["card"]
        version = msgspec.json.decode(text, type=dict[str, Any]).get("schema")
    except (*_UNDECODABLE, KeyError, TypeError) as error:
        raise SnapshotError(f"snapshot is unreadable: no card in its header ({error})") from None
    if version != SCHEMA:
        raise SnapshotError(f"snapshot has schema {version}, this build reads schema {SCHEMA}")
    try:
        return msgspec.json.decode(text, type=Card)
    except _UNDECODABLE as error:
        raise SnapshotError(f"snapshot card is invalid: {error}") from None


def _read_weights(card: Card, tensors: dict[str, NDArray[Any]]) -> PolicyWeights:
    """Return the weights, checked against the card."""
    sizes = [OBS_DIM, *card.hidden_dims, ACTION_DIM]
    shapes: dict[str, tuple[int, ...]] = {
        "normaliser.mean": (OBS_DIM,),
        "normaliser.std": (OBS_DIM,),
        "log_std": (ACTION_DIM,),
    }
    for index, (inputs, outputs) in enumerate(itertools.pairwise(sizes)):
        shapes[f"layers.{index}.weight"] = (outputs, inputs)
        shapes[f"layers.{index}.bias"] = (outputs,)
    if set(tensors) != set(shapes):
        odd = ", ".join(sorted(set(tensors) ^ set(shapes)))
        raise SnapshotError(f"snapshot has missing or unexpected tensors: {odd}")
    for name, shape in shapes.items():
        value = tensors[name]
        if value.dtype != np.float32 or value.shape != shape:
            raise SnapshotError(
                f"snapshot tensor {name} is {value.dtype}{list(value.shape)}, "
                f"expected float32{list(shape)}"
            )
        if not np.isfinite(value).all():
            raise SnapshotError(f"snapshot tensor {name} has a value that is not finite")
    if tensors["normaliser.std"].min() < 0.0:
        raise SnapshotError("snapshot tensor normaliser.std has a value below zero")
    if np.abs(tensors["log_std"]).max() > _MAX_LOG_STD:
        raise SnapshotError(f"snapshot tensor log_std has a value beyond +-{_MAX_LOG_STD:g}")
    weights = PolicyWeights(
        obs_mean=tensors["normaliser.mean"],
        obs_std=tensors["normaliser.std"],
        layers=tuple(
            (tensors[f"layers.{i}.weight"], tensors[f"layers.{i}.bias"])
            for i in range(len(sizes) - 1)
        ),
        log_std=tensors["log_std"],
        activation=card.activation,
    )
    if (found := normaliser_hash(weights.obs_mean, weights.obs_std)) != card.normaliser:
        raise SnapshotError(f"snapshot normaliser is {found}, its card says {card.normaliser}")
    return weights
