"""``python -m tests.integration.telemetry.showing DIR``: a recorder with something to show.

Prints the live view's address and records until its standard input ends.
"""

import contextlib
import select
import sys
from pathlib import Path

import numpy as np

from services.recorder.config import RecorderConfig
from services.recorder.service import Recorder
from shared.bus.memory import MemoryHub
from shared.clock import SystemClock
from shared.game.rules import RuleBook
from shared.messages.live import BoutFrames, Progress
from shared.messages.topics import FRAMES, PROGRESS
from shared.policy.action import ActionConfig
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel


def bout(env: FencingEnv, number: int, steps: int) -> BoutFrames:
    """Play a bout of slow wandering offsets and return every fourth instant."""
    generator = np.random.default_rng(number)
    env.reset(np.arange(1), generator)
    drift = generator.uniform(-1, 1, (2, 1, 6)).astype(np.float32)
    rows: list[tuple[object, ...]] = []
    for step in range(1, steps + 1):
        actions = drift * np.float32(np.cos(step / 90.0))
        judged = env.step(actions[0], actions[1])
        if step % 4 == 0:
            positions, quaternions = env.batch.body_poses(0)
            inside = (judged.antagonist_in_target[0], judged.protagonist_in_target[0])
            joints = env.batch.qpos[0].reshape(2, 7)
            rows.append(
                (step, positions.copy(), quaternions.copy(), joints.copy(), env.scores.score[0],
                 inside, judged.contact[0])
            )  # fmt: skip
    step, positions, quaternions, joints, score, inside, contact = zip(*rows, strict=True)
    return BoutFrames(
        actor="actor-0", lease="lease-1", bout=number, antagonist="sha256:" + "ab" * 32,
        protagonist="scripted:static", model=env.model.hash, steps=np.asarray(step, np.int32),
        positions=np.asarray(positions, np.float32),
        quaternions=np.asarray(quaternions, np.float32), joints=np.asarray(joints, np.float32),
        score=np.asarray(score, np.float32), in_target=np.asarray(inside, np.bool_),
        contact=np.asarray(contact, np.bool_),
    )  # fmt: skip


def main(folder: Path) -> None:
    """Record until standard input ends."""
    clock = SystemClock()
    hub = MemoryHub(clock)
    model = FencingModel.build(SimConfig())
    env = FencingEnv(model, RuleBook(), ActionConfig(), 1)
    frames = [bout(env, number, 2000) for number in range(2)]
    speaker, bus = hub.join("league-0"), hub.join("recorder-0")
    cfg = RecorderConfig(web_port=0, min_free_mib=1)
    with contextlib.closing(Recorder(cfg, bus, clock, folder, model)) as recorder:
        sys.stdout.write(f"{recorder.url}\n")
        sys.stdout.flush()
        begun, said = clock.now(), -1
        while not select.select([sys.stdin], [], [], 0.02)[0]:
            seconds = int(clock.now() - begun)
            if seconds != said:
                said = seconds
                speaker.publish(FRAMES, frames[seconds // 20 % 2], name="actor-0")
                speaker.publish(
                    PROGRESS,
                    Progress(
                        run="shown", stage=0, stages=4, phase="one", iteration=1,
                        agent="antagonist", update=seconds, max_updates=120,
                        total_samples=20480 * seconds, score_mean=30.0 * seconds,
                        score_low=30.0 * seconds - 50, score_high=30.0 * seconds + 50,
                        score_bouts=64, samples_per_s=60000.0, approx_kl=0.01,
                    ),
                )  # fmt: skip
            recorder.tick()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
