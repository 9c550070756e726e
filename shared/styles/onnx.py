"""A policy as an ONNX graph, for runtimes other than ours: the only door to onnx.

Built from the numbers of a snapshot, without torch. Input ``obs`` float32[N, 27] as
``shared.policy.observation`` encodes it, output ``mean`` float32[N, 6] in units of the action's
bounds, N free. The normaliser is inside: the mean is subtracted, and 1 / (std + 0.01) is folded
into the first layer as ``shared.policy.mlp`` does it. What the numbers mean and which schemas they
fit stands in the model's metadata. Old operators only (opset 17), for old runtimes too.
"""

# pyright: basic
# (onnx's types are partial)

from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, checker, helper, numpy_helper
from onnx.reference import ReferenceEvaluator

from shared.errors import SnapshotError
from shared.messages.training import ACTION_DIM, OBS_DIM
from shared.policy.mlp import NORMALISER_EPSILON, GaussianPolicy, PolicyWeights
from shared.policy.snapshot import Snapshot

Floats = NDArray[np.float32]
OPSET = 17
IR_VERSION = 8
TOLERANCE = 1e-6
"""Largest difference of the graph's output from ours, absolute or (above 1) relative."""
OPERATORS = {"tanh": "Tanh", "elu": "Elu"}


def build(snapshot: Snapshot) -> bytes:
    """Return the ONNX file of a snapshot; the same snapshot makes the same bytes.

    Raises:
        SnapshotError: the graph does not compute what the policy does (which is a defect).
    """
    model = helper.make_model(
        _graph(snapshot.weights),
        producer_name="riposte",
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        doc_string=f"{snapshot.card.agent} policy, version {snapshot.card.policy_version}",
    )
    helper.set_model_props(model, _metadata(snapshot))
    checker.check_model(model, full_check=True)
    payload = model.SerializeToString(deterministic=True)
    if (error := round_trip_error(payload, snapshot.weights)) > TOLERANCE:
        raise SnapshotError(
            f"the ONNX graph of {snapshot.digest[:12]} differs from the policy by {error:.2e}, "
            f"at most {TOLERANCE:g} is allowed; report this"
        )
    return payload


def metadata(payload: bytes) -> dict[str, str]:
    """Return what an exported file says of itself."""
    return {entry.key: entry.value for entry in onnx.load_from_string(payload).metadata_props}


def round_trip_error(payload: bytes, weights: PolicyWeights) -> float:
    """Return how far the graph, as onnx's reference computes it, is from our policy.

    Differences count absolutely up to outputs of size 1, relatively above. Observations are drawn
    about the normaliser, from typical to 100 standard deviations out.
    """
    generator = np.random.default_rng(0)
    obs = generator.standard_normal((256, OBS_DIM), np.float32)
    obs *= np.geomspace(0.1, 100.0, len(obs), dtype=np.float32)[:, None]
    obs = np.asarray(weights.obs_mean + weights.obs_std * obs, np.float32)
    expected = GaussianPolicy(weights).mean(obs)
    found: Any = ReferenceEvaluator(payload).run(["mean"], {"obs": obs})
    return float((np.abs(found[0] - expected) / np.maximum(1.0, np.abs(expected))).max())


def _graph(weights: PolicyWeights) -> onnx.GraphProto:
    scale = np.float32(1.0) / (weights.obs_std + NORMALISER_EPSILON)
    constants: dict[str, Any] = {"normaliser_mean": weights.obs_mean}
    nodes = [helper.make_node("Sub", ["obs", "normaliser_mean"], ["centred"], "normaliser")]
    value = "centred"
    last = len(weights.layers) - 1
    for k, (weight, bias) in enumerate(weights.layers):
        constants[f"weight_{k}"] = weight * scale if k == 0 else weight
        constants[f"bias_{k}"] = bias
        result = "mean" if k == last else f"sum_{k}"
        inputs = [value, f"weight_{k}", f"bias_{k}"]
        nodes.append(helper.make_node("Gemm", inputs, [result], f"layer_{k}", transB=1))
        if k < last:
            value = f"hidden_{k}"
            operator = OPERATORS[weights.activation]
            nodes.append(helper.make_node(operator, [result], [value], f"activation_{k}"))
    return helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("obs", TensorProto.FLOAT, ["N", OBS_DIM])],
        [helper.make_tensor_value_info("mean", TensorProto.FLOAT, ["N", ACTION_DIM])],
        [
            numpy_helper.from_array(np.ascontiguousarray(value, np.float32), name)
            for name, value in constants.items()
        ],
    )


def _metadata(snapshot: Snapshot) -> dict[str, str]:
    card = snapshot.card
    std = ", ".join(f"{value:.9g}" for value in np.exp(snapshot.weights.log_std))
    return {
        "snapshot_sha256": snapshot.digest,
        "agent": card.agent,
        "policy_version": str(card.policy_version),
        "run": card.run,
        "seed": str(card.seed),
        "observation_schema": card.observation_schema,
        "action_schema": card.action_schema,
        "normaliser": card.normaliser,
        "model": card.model,
        "control_timestep_s": f"{card.control_timestep:.9g}",
        "offset_bound_m": f"{card.offset_bound_m:.9g}",
        "offset_bound_rad": f"{card.offset_bound_rad:.9g}",
        "obs": "own bat position m, quaternion wxyz, velocity m/s, angular velocity rad/s; the "
        "other bat's; time s; in the arena frame of the own side; not normalised",
        "mean": "translation and rotation of the tool, each in units of its bound and at most 1 "
        "long when applied; the mean of the policy, without exploration",
        "exploration_std": std,
    }
