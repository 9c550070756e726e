"""Stages `hide` and `record`: a twin with a secret, and recordings of a programme on it."""

import argparse
import dataclasses
import shutil
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np

from services.jobs.identify import excite
from services.jobs.identify.from_bouts import of_bouts
from services.jobs.robot.play_programme import chosen
from services.jobs.robot.player import Player
from services.jobs.virtual_site import VirtualSite
from services.robot_io.config import RobotIoConfig, SafetyConfig
from shared.errors import RobotFault
from shared.identification.dataset.types import Dataset, Trajectory
from shared.identification.dataset.writing import write_dataset
from shared.identification.excitation.reading import PosePlan, read_programme
from shared.identification.hidden.noise import NoiseLevels, on_joints
from shared.runtime.files import atomic_write
from shared.sim.parameters import JOINT_NAMES, dump_parameters, load_parameters
from shared.telemetry.archive import archived_bouts, load_bout
from studies.closing_the_loop.protocol import Folders, Protocol, need

Say = Callable[[str], None]
MOST_SECONDS = 600.0
"""Of the twin's time, to play a programme."""
SETTLED = 1.0
"""After the last recording, until the recorder has filed it (s)."""
PARKED = Path(__file__).resolve().parents[2] / "deploy" / "parked_bat.npy"
"""A bat that lies still, 3 m away."""


def hide(protocol: Protocol, folders: Folders, say: Say) -> None:
    """Write the twin's model: late commands, and joints that are not quite the nominal ones."""
    if folders.truth.exists():
        return
    nominal = load_parameters("nominal")
    rng = np.random.default_rng(protocol.hidden_seed)
    joints = {}
    for name in JOINT_NAMES:
        own = nominal.joints[name]
        a, b, c = own.damping
        damping, armature = (1.0 + protocol.spread * rng.uniform(-1.0, 1.0, 2)).tolist()
        joints[name] = msgspec.structs.replace(
            own, damping=(damping * a, b, c), armature=armature * own.armature
        )
    hidden = msgspec.structs.replace(
        nominal,
        name="hidden",
        command=msgspec.structs.replace(nominal.command, delay=protocol.delay),
        joints=msgspec.structs.replace(nominal.joints, **joints),
    )
    atomic_write(folders.truth, dump_parameters(hidden).encode())
    say(f"hid {1000 * protocol.delay:g} ms of command latency in {folders.truth.name}")


def design(protocol: Protocol, folders: Folders, say: Say) -> PosePlan:
    """Return the programme, designed on the nominal model within the default limits."""
    if not folders.programme.exists():
        parser = argparse.ArgumentParser()
        excite.add_arguments(parser)
        words = ["--seconds", f"{protocol.seconds:g}", "--out", str(folders.programme)]
        if excite.run(parser.parse_args(words)) != 0:
            raise RobotFault("no programme could be designed")
        say("designed the programme")
    return read_programme(folders.programme)


def record(protocol: Protocol, folders: Folders, say: Say) -> None:
    """Play the programme on the twin, and make a data set of its archive."""
    if folders.dataset.exists():
        return
    plan = design(protocol, folders, say)
    if protocol.only:
        plan = dataclasses.replace(plan, stretches=tuple(chosen(plan, protocol.only)))
    shutil.rmtree(folders.recorded, ignore_errors=True)  # half a recording
    _play(protocol, folders, plan, say)
    bouts = [load_bout(folder) for folder in archived_bouts(folders.recorded)]
    dataset, left_out = of_bouts(bouts, plan=plan)
    for line in left_out:
        say(f"left out: {line}")
    noisy = with_encoder_noise(dataset, np.random.default_rng(protocol.hidden_seed + 1))
    write_dataset(noisy, folders.dataset, {"by": "studies.closing_the_loop"})


def _play(protocol: Protocol, folders: Folders, plan: PosePlan, say: Say) -> None:
    sim = msgspec.structs.replace(protocol.twin, model=str(need(folders.truth, "hide")))
    robot = RobotIoConfig(
        twin_filter=1.0, twin_delay=0.0, twin_force=30.0, tracker="replay", replay=str(PARKED)
    )
    site = VirtualSite(folders.recorded, robot, SafetyConfig(), sim)
    try:
        person = site.join("robot-1")
        player = Player(
            plan, plan.stretches, protocol.countdown, "the study", MOST_SECONDS, person, site.clock,
            say,
        )  # fmt: skip
        ends = site.clock.now() + MOST_SECONDS
        while not player.is_over and site.clock.now() < ends:
            site.tick(player)
            if player.step == "waiting" and site.is_quiet:
                site.ask(person, "arm")
        if player.step != "done":
            raise RobotFault(f"the programme was not played: {player.problem or player.step}")
        player.stop("the programme is over")
        for _ in range(round(SETTLED / sim.control_timestep)):
            site.tick(player)
        player.close()
    finally:
        site.close()


def with_encoder_noise(dataset: Dataset, rng: np.random.Generator) -> Dataset:
    """Return recordings as encoders of 0.3 mrad would have made them; a twin reads exactly."""
    levels = NoiseLevels()

    def noisy(each: Trajectory) -> Trajectory:
        q = on_joints(levels, each.joints_at, each.q, rng)
        return dataclasses.replace(each, q=q, qd=None, effort=None, initial_q=q[0])

    return dataclasses.replace(dataset, trajectories=tuple(map(noisy, dataset.trajectories)))
