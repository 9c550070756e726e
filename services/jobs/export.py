"""`riposte export SNAPSHOT --onnx FILE`: a trained policy for other runtimes."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from services.jobs.runs import state_of
from services.league.snapshots import SnapshotStore
from shared.errors import ConfigError, SnapshotError
from shared.messages.training import AGENTS, Agent
from shared.policy.snapshot import MAX_BYTES, Snapshot, unpack
from shared.runtime.files import atomic_write


def main(argv: Sequence[str]) -> int:
    """Run ``riposte export``; return the exit code."""
    parser = argparse.ArgumentParser(prog="riposte export", description=__doc__)
    parser.add_argument(
        "snapshot", metavar="SNAPSHOT",
        help="a .safetensors file, or RUN:antagonist or RUN:protagonist for a run's latest",
    )  # fmt: skip
    parser.add_argument("--onnx", type=Path, required=True, metavar="FILE", help="file to write")
    parser.add_argument("--json", action="store_true", help="say what was written as JSON")
    found = parser.parse_args(argv)
    from shared.styles import onnx  # slow to import: not for a mistyped command line

    snapshot = find_snapshot(found.snapshot)
    payload = onnx.build(snapshot)
    if not found.onnx.parent.is_dir():
        raise ConfigError(f"--onnx {found.onnx}: there is no folder {found.onnx.parent}; make it")
    atomic_write(found.onnx, payload)
    error = onnx.round_trip_error(payload, snapshot.weights)
    card = snapshot.card
    if found.json:
        facts = {
            "file": str(found.onnx),
            "bytes": len(payload),
            "snapshot": snapshot.reference,
            "agent": card.agent,
            "policy_version": card.policy_version,
            "round_trip_error": error,
        }
        print(json.dumps(facts))
    else:
        print(
            f"wrote {found.onnx}: {card.agent} version {card.policy_version} of {card.run}, "
            f"{len(payload):,} bytes; largest difference from the policy {error:.1e}"
        )
    return 0


def find_snapshot(text: str) -> Snapshot:
    """Return the snapshot that a command line names: a file, or a run and an agent.

    Raises:
        RiposteError: there is no such file, run or agent, or it is damaged.
    """
    run, _, agent = text.rpartition(":")
    for known in AGENTS:
        if run and agent == known:
            return _latest(Path(run), known)
    path = Path(text)
    if path.is_dir():
        raise ConfigError(
            f"{text} is a folder; say whose policy with {text}:antagonist or {text}:protagonist"
        )
    try:
        with path.open("rb") as file:
            payload = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise SnapshotError(
            f"snapshot {text} cannot be read ({error.strerror}); "
            "give a .safetensors file, RUN:antagonist or RUN:protagonist"
        ) from None
    return unpack(payload)


def _latest(run: Path, agent: Agent) -> Snapshot:
    """Return the newest version of an agent in a run."""
    record = state_of(run).latest(agent)
    if record is None:
        raise SnapshotError(f"{run} has no version of the {agent} yet; let it train for a while")
    return unpack(SnapshotStore(run / "snapshots").get(record.ref), record.snapshot)
