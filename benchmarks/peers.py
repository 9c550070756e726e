"""Training samples a second against other projects' loops: same environment, same PPO, two cores.

Each peer lives in a virtual environment of its own (`benchmarks/requirements`), made on
the first run, and trains the antagonist against a frozen fresh protagonist, as ours does. Of each
the fastest mode is taken: all of them are tried for a shorter window first. Rounds are interleaved.
"""

import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.environments import CannotInstallError, interpreter, size_mib
from benchmarks.harness import interleaved, median, on_first_cores
from benchmarks.peer_loops.running import Peer, PeerFailedError, fresh_protagonist, run, work_of
from benchmarks.train import RUNNERS, ours
from services.jobs.bench import Check, Measurement
from services.jobs.settings import Settings

QUESTION = "training samples/s of a real run against other projects' loops, on two cores"
IN_PROCESS_GOAL, DISTRIBUTED_GOAL = 1.5, 5.0


def _in_process(name: str, module: str, requirements: str) -> tuple[Peer, ...]:
    """Return the ways in which a loop in one process can run: those of rsl_rl's runner."""
    return tuple(
        msgspec.structs.replace(runner, name=name, module=module, requirements=requirements)
        for runner in RUNNERS
    )


PEERS = (
    *RUNNERS,
    *_in_process("CleanRL's style", "cleanrl_style", ""),
    *_in_process("Stable-Baselines3", "stable_baselines3", "stable-baselines3"),
    *(
        Peer(name="Sample Factory", module="sample_factory", requirements="sample-factory",
             mode=mode, num_envs=num_envs, is_distributed=True)
        for mode in ("serial", "sync", "async")
        for num_envs in (128, 256)
    ),
    *(
        Peer(name="RLlib", module="rllib", requirements="rllib", mode=mode, num_envs=num_envs,
             is_distributed=True)
        for mode in ("ppo", "appo")
        for num_envs in (64, 128)
    ),
)  # fmt: skip


def fastest(settings: Settings, opponent: Path, seconds: float, *, smoke: bool) -> Iterator[
    tuple[Peer, list[dict[str, Any]]]
]:  # fmt: skip
    """Try every mode of every peer; yield each project's fastest with all that was tried."""
    for name in dict.fromkeys(peer.name for peer in PEERS):
        modes = [peer for peer in PEERS if peer.name == name][: 1 if smoke else None]
        tried: list[tuple[float, Peer, dict[str, Any]]] = []
        for peer in modes:
            try:
                figures = run(peer, work_of(peer, settings, opponent, seconds))
            except (CannotInstallError, PeerFailedError) as error:
                print(f"left out: {peer.mode} with {peer.num_envs}: {error}", file=sys.stderr)
                continue
            print(_line(figures), file=sys.stderr, flush=True)
            tried.append((figures["samples_per_s"], peer, figures))
        if tried:
            yield max(tried, key=lambda one: one[0])[1], [one[2] for one in tried]


def _line(figures: dict[str, Any]) -> str:
    how = f"{figures['mode'] or 'in process'}, {figures['num_envs']} bouts"
    return (
        f"{figures['peer']:<18} {how:<22} {figures['threads']} threads "
        f"{figures['samples_per_s']:9,.0f} samples/s {figures['samples_per_cpu_s']:9,.0f} a CPU s"
    )


def measure(smoke: bool) -> Measurement:
    """Return our training speed beside every peer's fastest mode."""
    seconds, rounds = (1.0, 1) if smoke else (25.0, 3)
    settings = Settings.load(None)
    with on_first_cores(2), tempfile.TemporaryDirectory(prefix="riposte-peers-") as folder:
        opponent = fresh_protagonist(settings, Path(folder) / "opponent.safetensors")
        found = list(fastest(settings, opponent, min(seconds, 10.0), smoke=smoke))

        def side(peer: Peer) -> Callable[[], dict[str, Any]]:
            return lambda: run(peer, work_of(peer, settings, opponent, seconds))

        sides = [lambda: ours(seconds), *(side(peer) for peer, _ in found)]
        turns = interleaved(rounds, sides)
    return _measurement([peer for peer, _ in found], turns, [tried for _, tried in found])


def _measurement(
    peers: list[Peer], turns: list[tuple[dict[str, Any], ...]], tried: list[list[dict[str, Any]]]
) -> Measurement:
    runs = tuple(
        {"ours": our["samples_per_s"], "ours_per_cpu_s": our["samples_per_cpu_s"]}
        | {peer.name: their["samples_per_s"] for peer, their in zip(peers, theirs, strict=True)}
        | {
            f"{peer.name}, per CPU second": their["samples_per_cpu_s"]
            for peer, their in zip(peers, theirs, strict=True)
        }
        | {
            f"ratio to {peer.name}": our["samples_per_s"] / their["samples_per_s"]
            for peer, their in zip(peers, theirs, strict=True)
        }
        for our, *theirs in turns
    )
    best = max(
        (peer for peer in peers if not peer.is_distributed),
        key=lambda peer: median(runs, peer.name),
    )
    ratios = [
        Check(
            name=f"ours / {peer.name}", value=median(runs, f"ratio to {peer.name}"),
            goal=DISTRIBUTED_GOAL if peer.is_distributed else IN_PROCESS_GOAL,
        )
        for peer in peers if peer is not best
    ]  # fmt: skip
    figures = [
        Check(name=f"{what} {peer.name}", value=value, unit=unit)
        for peer, their in zip(peers, turns[-1][1:], strict=True)
        for what, value, unit in (
            ("samples/s of", median(runs, peer.name), ""),
            ("per CPU second of", median(runs, f"{peer.name}, per CPU second"), ""),
            ("first update of", their["first_update_s"], "s"),
            ("memory of", their["resident_mib"], "MiB"),
        )
    ]
    sizes = {
        name: size_mib(interpreter(name))
        for name in dict.fromkeys(peer.requirements for peer in peers if peer.requirements)
    }
    return Measurement(
        value=median(runs, "ours"),
        unit="samples/s",
        limit=median(runs, best.name),
        ratio=Check(
            name=f"ours / {best.name}, the best in one process",
            value=median(runs, f"ratio to {best.name}"), goal=IN_PROCESS_GOAL,
        ),
        runs=runs,
        checks=(*ratios, Check(name="ours per CPU second", value=median(runs, "ours_per_cpu_s")),
                *figures),
        details={"tried": tried, "turns": turns, "environments_mib": sizes},
    )  # fmt: skip
