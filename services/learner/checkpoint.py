"""A learner's checkpoints: whole or not there, checked on reading, the newest few kept.

One safetensors file a version, ``checkpoint-<version:08d>.safetensors``, with one metadata entry
``meta`` (JSON): whose it is, what it is, and the SHA-256 of its tensors. One more,
``warm.safetensors``, is kept from the end of phase one on: every round of phase two begins with it.
"""

import hashlib
import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import structlog
import torch
from safetensors import SafetensorError
from safetensors.numpy import load, save

from shared.errors import CheckpointError
from shared.messages.training import Agent, UpdateMetrics
from shared.runtime.files import atomic_write

log = structlog.get_logger()

SCHEMA = 1


class Meta(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a checkpoint is, beside its tensors."""

    schema: int = SCHEMA
    run: str
    agent: Agent
    seed: int
    policy_version: int
    stage: int
    """In which this version was made; -1 for version 0."""
    stage_updates: int = 0
    """Updates of this agent in that stage, this one included."""
    total_samples: int
    applied: str
    """Names of all rollouts learned from (``Applied.to_json``)."""
    rollouts: tuple[str, ...]
    """Names of those behind this very version."""
    metrics: UpdateMetrics | None
    round: int = 0
    """Round of phase two this policy has come from the warm start in; 0 in phase one."""
    floor: int = 0
    """Rollouts of versions before this one are of another round's policy."""
    tensors: str = ""
    """SHA-256 over names, shapes and bytes of the tensors."""


class CheckpointStore:
    """The checkpoints of one agent in one run."""

    def __init__(self, folder: Path, run: str, agent: Agent, keep: int) -> None:
        """Look into a folder, which is made when it is not there.

        Args:
            folder: of this agent's checkpoints.
            run: they must belong to.
            agent: they must belong to.
            keep: how many to leave on disk.
        """
        self._folder = folder
        self._run = run
        self._agent: Agent = agent
        self._keep = keep
        folder.mkdir(parents=True, exist_ok=True)

    def path(self, version: int) -> Path:
        """Return where a version is or would be."""
        return self._folder / f"checkpoint-{version:08d}.safetensors"

    def versions(self) -> list[int]:
        """Return the versions on disk, newest first."""
        names = self._folder.glob(f"checkpoint-{'[0-9]' * 8}.safetensors")
        return sorted((int(p.stem.removeprefix("checkpoint-")) for p in names), reverse=True)

    @property
    def warm_path(self) -> Path:
        """Return where the end of phase one is or would be."""
        return self._folder / "warm.safetensors"

    def save(self, meta: Meta, tensors: dict[str, torch.Tensor]) -> None:
        """Write a checkpoint, then forget the oldest beyond the number kept.

        Raises:
            RiposteError: the disk is full or not writable; older checkpoints are intact.
        """
        _write(self.path(meta.policy_version), meta, tensors)
        for old in self.versions()[self._keep :]:
            if old != meta.policy_version:
                self.path(old).unlink(missing_ok=True)

    def discard_after(self, version: int) -> None:
        """Forget versions newer than this one: a serial run goes back to a cut."""
        for newer in self.versions():
            if newer > version:
                self.path(newer).unlink(missing_ok=True)
        if self.warm_path.exists() and self.load_warm()[0].policy_version > version:
            self.warm_path.unlink()

    def save_warm(self, meta: Meta, tensors: dict[str, torch.Tensor]) -> None:
        """Keep the end of phase one for good.

        Raises:
            RiposteError: the disk is full or not writable.
        """
        _write(self.warm_path, meta, tensors)

    def load_warm(self) -> tuple[Meta, dict[str, torch.Tensor]]:
        """Return the end of phase one.

        Raises:
            CheckpointError: missing, damaged, or of another run or agent; says which.
        """
        return self._load(self.warm_path)

    def load(self, version: int) -> tuple[Meta, dict[str, torch.Tensor]]:
        """Return one checkpoint.

        Raises:
            CheckpointError: missing, damaged, or of another run or agent; says which.
        """
        return self._load(self.path(version))

    def _load(self, path: Path) -> tuple[Meta, dict[str, torch.Tensor]]:
        try:
            payload = path.read_bytes()
            header_bytes = int.from_bytes(payload[:8], "little")
            header = msgspec.json.decode(payload[8 : 8 + header_bytes], type=dict[str, Any])
            meta = msgspec.json.decode(header["__metadata__"]["meta"], type=Meta)
            arrays = load(payload)
        except OSError as error:
            raise CheckpointError(f"cannot read {path}: {error.strerror}") from None
        except (SafetensorError, KeyError, TypeError, ValueError, RecursionError) as error:
            text = " ".join(str(error).split())
            raise CheckpointError(f"checkpoint {path} is damaged: {text}") from None
        for field, wanted in (("schema", SCHEMA), ("run", self._run), ("agent", self._agent)):
            if (found := getattr(meta, field)) != wanted:
                raise CheckpointError(
                    f"checkpoint {path} does not belong here: its {field} is {found}, "
                    f"expected {wanted}"
                )
        if _digest(arrays) != meta.tensors:
            raise CheckpointError(f"checkpoint {path} is damaged: its tensors are not those saved")
        return meta, {name: torch.tensor(value) for name, value in arrays.items()}

    def load_newest(self) -> tuple[Meta, dict[str, torch.Tensor], list[str]] | None:
        """Return the newest checkpoint that is whole, and what was wrong with newer ones.

        None when there is none at all.

        Raises:
            CheckpointError: there are some, and none of them is usable.
        """
        faults: list[str] = []
        for version in self.versions():
            try:
                meta, tensors = self.load(version)
            except CheckpointError as error:
                log.error("checkpoint_corrupt", version=version, reason=str(error))
                faults.append(str(error))
                continue
            return meta, tensors, faults
        if faults:
            raise CheckpointError(
                f"no usable checkpoint in {self._folder}: {'; '.join(faults)}; "
                "restore one, or start a new run with another --out"
            )
        return None


def _write(path: Path, meta: Meta, tensors: dict[str, torch.Tensor]) -> None:
    arrays = {name: value.numpy() for name, value in tensors.items()}
    meta = msgspec.structs.replace(meta, tensors=_digest(arrays))
    text = json.dumps(msgspec.to_builtins(meta), sort_keys=True)
    atomic_write(path, save(arrays, metadata={"meta": text}))


def _digest(arrays: dict[str, Any]) -> str:
    """Return the SHA-256 over names, dtypes, shapes and bytes, in the order of the names."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name}|{array.dtype}|{arrays[name].shape}|".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()
