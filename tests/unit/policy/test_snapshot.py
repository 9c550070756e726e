"""The policy artifact: same policy same bytes, and every damage is named."""

import json
from typing import Any

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray
from safetensors.numpy import load, save

from shared.errors import SnapshotError
from shared.policy.mlp import GaussianPolicy
from shared.policy.snapshot import MAX_BYTES, Fit, Snapshot, digest_of, reference_of, unpack
from tests.unit.policy.making import FIT, card, snapshot, weights


def rewritten(made: Snapshot, card: dict[str, Any] | None = None, **tensors: Any) -> bytes:
    """Return the file with other tensors (None takes one away) or another card."""
    arrays: dict[str, NDArray[Any]] = dict(load(made.payload))
    for name, value in tensors.items():
        arrays.pop(name, None)
        if value is not None:
            arrays[name] = value
    text = json.dumps((msgspec.to_builtins(made.card) | (card or {})), sort_keys=True)
    return save(arrays, metadata={"card": text})


def with_header(header: bytes) -> bytes:
    return len(header).to_bytes(8, "little") + header


def test_a_snapshot_read_back_is_the_one_packed():
    made = snapshot()
    read = unpack(made.payload, made.digest)
    assert read.card == made.card
    assert read.digest == made.digest
    assert read.reference == f"sha256:{made.digest}"
    for name in ("obs_mean", "obs_std", "log_std"):
        np.testing.assert_array_equal(getattr(read.weights, name), getattr(made.weights, name))
    for mine, theirs in zip(read.weights.layers, made.weights.layers, strict=True):
        for one, other in zip(mine, theirs, strict=True):
            np.testing.assert_array_equal(one, other)
    obs = np.random.default_rng(0).normal(size=(5, 27)).astype(np.float32)
    np.testing.assert_array_equal(
        GaussianPolicy(read.weights).mean(obs), GaussianPolicy(made.weights).mean(obs)
    )


def test_the_same_policy_is_always_the_same_bytes():
    assert snapshot().payload == snapshot().payload
    assert snapshot().payload == rewritten(snapshot())
    assert snapshot(seed=1).digest != snapshot().digest
    assert snapshot(policy_version=4).digest != snapshot().digest


@pytest.mark.parametrize("keep", [0, 7, 8, 100, -1])
def test_a_file_cut_short_is_refused(keep: int):
    with pytest.raises(SnapshotError, match="unreadable"):
        unpack(snapshot().payload[:keep])


def test_a_flipped_byte_is_seen_by_the_hash():
    made = snapshot()
    damaged = bytearray(made.payload)
    damaged[-5] ^= 1
    with pytest.raises(SnapshotError, match=f"damaged: its hash is .*, not {made.digest[:12]}"):
        unpack(bytes(damaged), made.digest)


def test_a_flipped_byte_in_the_normaliser_is_seen_without_a_hash():
    made = snapshot()
    mean = made.weights.obs_mean.copy()
    mean[3] += 1.0
    with pytest.raises(SnapshotError, match=r"normaliser is \w+, its card says"):
        unpack(rewritten(made, **{"normaliser.mean": mean}))


def test_a_snapshot_over_the_limit_is_refused_unread():
    with pytest.raises(SnapshotError, match=f"over the limit of {MAX_BYTES}"):
        unpack(bytes(MAX_BYTES + 1))


def test_another_schema_is_named():
    with pytest.raises(SnapshotError, match="has schema 2, this build reads schema 1"):
        unpack(rewritten(snapshot(), {"schema": 2}))


@pytest.mark.parametrize(
    "changes", [{"agent": "referee"}, {"policy_version": "three"}, {"surprise": 1}]
)
def test_an_invalid_card_names_the_field(changes: dict[str, Any]):
    with pytest.raises(SnapshotError, match=f"card is invalid.*{next(iter(changes))}"):
        unpack(rewritten(snapshot(), changes))


@pytest.mark.parametrize("name", ["log_std", "layers.1.bias", "normaliser.std"])
def test_a_missing_tensor_is_named(name: str):
    with pytest.raises(SnapshotError, match=f"missing or unexpected tensors: {name}"):
        unpack(rewritten(snapshot(), **{name: None}))


def test_a_tensor_too_many_is_named():
    with pytest.raises(SnapshotError, match="unexpected tensors: critic"):
        unpack(rewritten(snapshot(), critic=np.zeros(3, np.float32)))


@pytest.mark.parametrize(
    ("value", "found"),
    [
        (np.zeros(5, np.float32), r"float32\[5\]"),
        (np.zeros((6, 1), np.float32), r"float32\[6, 1\]"),
        (np.zeros(6, np.float64), r"float64\[6\]"),
    ],
)
def test_a_tensor_of_another_shape_or_type_is_named(value: NDArray[Any], found: str):
    with pytest.raises(SnapshotError, match=rf"log_std is {found}, expected float32\[6\]"):
        unpack(rewritten(snapshot(), log_std=value))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_number_that_is_not_finite_is_named(bad: float):
    weight = snapshot().weights.layers[0][0].copy()
    weight[2, 2] = bad
    with pytest.raises(SnapshotError, match=r"layers\.0\.weight has a value that is not finite"):
        unpack(rewritten(snapshot(), **{"layers.0.weight": weight}))


def test_deviations_that_cannot_be_are_named():
    made = snapshot()
    std = made.weights.obs_std.copy()
    std[0] = -0.01
    with pytest.raises(SnapshotError, match=r"normaliser\.std"):
        unpack(rewritten(made, **{"normaliser.std": std}))
    with pytest.raises(SnapshotError, match="log_std"):
        unpack(rewritten(made, log_std=np.full(6, 1e3, np.float32)))


@pytest.mark.parametrize(
    "header",
    [
        b"",
        b"{}",
        b"[]",
        b'{"__metadata__": 3}',
        b'{"__metadata__": {"card": 3}}',
        b'{"__metadata__": {"card": "[]"}}',
        b'{"__metadata__": {"card": "{"}}',
        b"\xff\xfe",
        b'{"a":' + b"[" * 60000 + b"]" * 2,
        b'{"__metadata__": {"card": "' + b"[" * 60000 + b'"}}',
    ],
)
def test_a_strange_header_is_refused(header: bytes):
    with pytest.raises(SnapshotError):
        unpack(with_header(header))


def test_a_tensor_type_that_numpy_lacks_is_refused():
    text = json.dumps(msgspec.to_builtins(snapshot().card))
    header = json.dumps(
        {
            "__metadata__": {"card": text},
            "log_std": {"dtype": "BF16", "shape": [1], "data_offsets": [0, 2]},
        }
    ).encode()
    with pytest.raises(SnapshotError):
        unpack(with_header(header) + bytes(2))


def test_a_snapshot_fits_what_it_was_made_for():
    snapshot().check_fits(FIT)
    snapshot().check_fits(msgspec.structs.replace(FIT, model=None))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("observation_schema", "0" * 16),
        ("action_schema", "0" * 16),
        ("control_timestep", 0.02),
        ("offset_bound_m", 0.05),
        ("offset_bound_rad", 0.05),
        ("model", "other"),
    ],
)
def test_a_snapshot_that_does_not_fit_names_the_field_and_both_values(field: str, value: Any):
    with pytest.raises(SnapshotError, match=f"its {field} is {value}, this process needs"):
        snapshot(**{field: value}).check_fits(FIT)


def test_a_robot_takes_a_policy_trained_in_any_model():
    snapshot(model="other").check_fits(
        Fit(control_timestep=0.01, offset_bound_m=0.0375, offset_bound_rad=0.06)
    )


def test_references_and_digests_go_both_ways():
    digest = snapshot().digest
    assert digest_of(reference_of(digest)) == digest


@pytest.mark.parametrize(
    "reference", ["", "sha256:", "a" * 64, "sha256:" + "A" * 64, "sha256:" + "g" * 64, "sha256:ab"]
)
def test_a_reference_that_is_none_is_refused(reference: str):
    with pytest.raises(SnapshotError, match="is no snapshot"):
        digest_of(reference)


def test_networks_of_any_depth_are_read():
    from shared.policy.snapshot import pack

    for hidden in ((), (3,), (4, 5, 6)):
        made = weights(hidden, "elu")
        read = unpack(pack(card(made), made).payload)
        assert read.card.hidden_dims == hidden
        assert len(read.weights.layers) == len(hidden) + 1
