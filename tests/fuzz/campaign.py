"""The parent of a fuzzing campaign: children, their crashes and hangs, and what is left of them."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import msgspec

from shared.runtime.files import atomic_write
from tests.fuzz.order import Engine, Order
from tests.fuzz.registry import targets_of
from tests.fuzz.worker import Box, Fault, Result, Tally

HANG_SECONDS = 60.0
"""Wall clock without a new input, after which a child hangs; this machine may be busy."""
START_SECONDS = 120.0
MOST_CRASHES = 20
"""Of one group; then it is given up."""


class Progress(msgspec.Struct, kw_only=True):
    """How far a group is; on disk, so that a campaign goes on where it was stopped."""

    done: int = 0
    seconds: float = 0.0
    tallies: dict[str, Tally] = {}
    faults: list[Fault] = []
    crashes: int = 0
    hangs: int = 0


@dataclasses.dataclass(frozen=True)
class Plan:
    """What to fuzz."""

    group: str
    inputs: int
    seed: int
    folder: Path
    engine: Engine = "mutate"
    chunk: int = 20_000
    """Inputs of one child."""
    only: str = ""
    """Name of one target; needed by ``atheris``."""
    registry: str = "tests.fuzz.registry"
    hang_seconds: float = HANG_SECONDS

    @property
    def name(self) -> str:
        return f"{(self.only or self.group).replace('/', '-')}-{self.engine}"


def run(plan: Plan, say: Callable[[str], None] = print) -> Progress:
    """Read all inputs of a plan that were not read before; returns the sum of all."""
    plan.folder.mkdir(parents=True, exist_ok=True)
    state = plan.folder / f"{plan.name}.json"
    progress = (
        msgspec.json.decode(state.read_bytes(), type=Progress) if state.exists() else Progress()
    )
    while progress.done < plan.inputs and progress.crashes + progress.hangs < MOST_CRASHES:
        began = time.monotonic()
        _chunk(plan, progress)
        progress.seconds += time.monotonic() - began
        atomic_write(state, msgspec.json.encode(progress))
        say(
            f"{plan.name}: {progress.done} of {plan.inputs}, {len(progress.faults)} faults, "
            f"{progress.seconds:.0f} s"
        )
    return progress


def _chunk(plan: Plan, progress: Progress) -> None:
    """Let one child read, and add what it found."""
    box, result = (plan.folder.resolve() / f"{plan.name}.{end}" for end in ("box", "result"))
    result.unlink(missing_ok=True)
    order = Order(
        group=plan.group, only=plan.only, engine=plan.engine, seed=plan.seed, first=progress.done,
        count=min(plan.chunk, plan.inputs - progress.done), box=str(box), result=str(result),
        registry=plan.registry,
    )  # fmt: skip
    Box(box).put(order.first, 0, b"")
    ended, said = _watched(order, box, plan)
    if result.exists():
        found = msgspec.json.decode(result.read_bytes(), type=Result)
        for name, tally in found.tallies.items():
            progress.tallies[name] = _sum(progress.tallies.get(name, Tally()), tally)
        progress.faults += found.faults
        progress.done += found.done
        if ended == 0:
            return
    index, which, data = Box(box).get()
    if not data:
        raise RuntimeError(f"the child of {plan.name} did not start (exit {ended}): {said}")
    kind = "hung" if ended is None else "crashed"
    why = "no new input" if ended is None else f"exit {ended}: {said}"
    names = [each.name for each in targets_of(plan.group, plan.folder, plan.registry)]
    name = plan.only or names[which]
    progress.faults.append(Fault(target=name, kind=kind, index=index, why=why, data=data))
    progress.hangs += ended is None
    progress.crashes += ended is not None
    progress.done = max(progress.done, index + 1)  # the inputs before it are not counted


def _watched(order: Order, box: Path, plan: Plan) -> tuple[int | None, str]:
    """Run a child; returns its exit status, None where it hung, and its last words."""
    words = msgspec.json.encode(order).decode()
    errors = plan.folder / f"{plan.name}.stderr"
    with errors.open("wb") as stderr:
        child = subprocess.Popen(
            [sys.executable, "-m", "tests.fuzz.worker", words],
            stdin=subprocess.DEVNULL, stdout=stderr, stderr=stderr, start_new_session=True,
            env={**os.environ, "PYTHONFAULTHANDLER": "1"},
        )  # fmt: skip
        seen, since = Box(box), time.monotonic()
        last, patience = seen.get(), START_SECONDS
        ended: int | None = None
        while True:
            try:
                ended = child.wait(0.2)
                break
            except subprocess.TimeoutExpired:
                now = seen.get()
            if now != last:
                last, since, patience = now, time.monotonic(), plan.hang_seconds
            elif time.monotonic() - since > patience:
                os.killpg(child.pid, signal.SIGKILL)
                child.wait()
                break
    return ended, errors.read_text("utf-8", "replace")[-600:]


def _sum(one: Tally, other: Tally) -> Tally:
    return Tally(
        inputs=one.inputs + other.inputs,
        accepted=one.accepted + other.accepted,
        seconds=max(one.seconds, other.seconds),
        memory=max(one.memory, other.memory),
    )


def both(one: Progress, other: Progress) -> Progress:
    """Return the sum of two campaigns."""
    tallies = dict(one.tallies)
    for name, tally in other.tallies.items():
        tallies[name] = _sum(tallies.get(name, Tally()), tally)
    return Progress(
        done=one.done + other.done, seconds=one.seconds + other.seconds, tallies=tallies,
        faults=one.faults + other.faults, crashes=one.crashes + other.crashes,
        hangs=one.hangs + other.hangs,
    )  # fmt: skip


def save_faults(progress: Progress, folder: Path) -> list[Path]:
    """Write the inputs of all faults, each with its story; returns their files."""
    folder.mkdir(parents=True, exist_ok=True)
    made: list[Path] = []
    for number, fault in enumerate(progress.faults):
        name = f"{fault.target.replace('/', '-')}-{fault.kind}-{number}"
        atomic_write(folder / f"{name}.bin", fault.data)
        story = {"target": fault.target, "kind": fault.kind, "index": fault.index, "why": fault.why}
        atomic_write(folder / f"{name}.json", json.dumps(story, indent=1).encode())
        made.append(folder / f"{name}.bin")
    return made
