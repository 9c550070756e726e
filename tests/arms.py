"""A small arm for the tests of identification: three hinges, links of known mass, a bat."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Effect
from shared.sim.plant.plant import Plant, is_weightless, mjcf
from shared.sim.plant.replay import Recorded, Reports
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal

JOINTS = ("pan", "lift", "elbow")
_SERVOS = {
    "position": "\n".join(
        f'<position name="{name}" joint="{name}" kp="200" kv="10"/>' for name in JOINTS
    ),
    "torque": "\n".join(f'<motor name="{name}" joint="{name}"/>' for name in JOINTS),
}
_ARM = """
<mujoco model="three hinges">
  <compiler angle="radian"/>
  <option timestep="0.002" gravity="0 0 {gravity}"/>
  <worldbody>
    <body name="column" pos="0 0 0.5">
      <inertial pos="0 0 0" mass="5" diaginertia="0.05 0.05 0.05"/>
      <body name="shoulder">
        <joint name="pan" axis="0 0 1" range="-2 2" damping="0.5" armature="0.02"
               frictionloss="0.1" actuatorfrcrange="-20 20"/>
        <inertial pos="0 0 0" mass="0.5" diaginertia="0.002 0.002 0.002"/>
        <body name="upper" >
          <joint name="lift" axis="0 1 0" range="-1.5 1.5" damping="0.5" armature="0.02"
                 frictionloss="0.1" actuatorfrcrange="-20 20"/>
          <inertial pos="0.2 0 0" mass="1.0" diaginertia="0.002 0.015 0.015"/>
          <body name="fore" pos="0.4 0 0">
            <joint name="elbow" axis="0 1 0" range="-2.5 0.5" damping="0.2" armature="0.01"
                   frictionloss="0.05" actuatorfrcrange="-10 10"/>
            <inertial pos="0.15 0 0" mass="0.5" diaginertia="0.001 0.004 0.004"/>
            <site name="tool" pos="0.3 0 0"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>{servos}</actuator>
</mujoco>
"""


def write_arm(
    folder: Path, control: Literal["position", "torque"] = "position", has_gravity: bool = True
) -> Path:
    """Write the arm's MJCF.

    Held straight out (all joints at 0), gravity asks of the lift 9.81 (1 kg 0.2 m + 0.5 kg 0.55 m)
    = 4.66 N m and of the elbow 9.81 0.5 kg 0.15 m = 0.736 N m, both against the positive turn.
    """
    path = folder / f"arm_{control}_{'heavy' if has_gravity else 'weightless'}.xml"
    path.write_text(_ARM.format(gravity=-9.81 if has_gravity else 0.0, servos=_SERVOS[control]))
    return path


def make_plant(
    folder: Path, control: Literal["position", "torque"] = "position", has_gravity: bool = True
) -> Plant:
    """Return the arm."""
    path = write_arm(folder, control, has_gravity)
    return mjcf(path, control, JOINTS, JOINTS, "tool")


def make_subject(plant: Plant, has_tracker: bool = True) -> Subject:
    """Return the arm with recordings in which every joint moves fast enough for everything."""
    nominal = Rollouts(plant, (), 8)
    count = len(plant.labels)
    return Subject(
        plant=plant,
        nominal=nominal,
        has_tracker=has_tracker,
        has_gravity=not is_weightless(nominal.model),
        trajectories=("slow", "fast"),
        duration=10.0,
        travel=np.full(count, 1.0),
        lowest=np.full(count, -0.5),
        speed=np.full(count, 1.0),
        acceleration=np.full(count, 4.0),
        drive=np.full(count, 5.0),
    )


def still(subject: Subject, moving: str) -> Subject:
    """Return the arm with recordings in which only one joint moves."""
    moves = np.array([name == moving for name in subject.joints], np.float64)
    return replace(subject, travel=subject.travel * moves, speed=subject.speed * moves)


def recorded(
    command: Callable[[Float64], Float64] | Sequence[float],
    seconds: float = 1.0,
    initial_q: Sequence[float] = (0.0, 0.0, 0.0),
    trajectory: str = "slow",
) -> Recorded:
    """Return what the arm replays: a command that stands still, or follows instants (s)."""
    at: Float64 = np.arange(0.0, seconds, 0.01)
    values = command(at) if callable(command) else np.tile(np.asarray(command, float), (len(at), 1))
    q = np.asarray(initial_q, np.float64)
    return Recorded(
        initial_q=q,
        initial_qd=np.zeros_like(q),
        command=Signal(at, values),
        logged_q=Signal(at, np.tile(q, (len(at), 1))),
        joints_at=at,
        tracker_at=at,
        trajectory=trajectory,
    )


def replay(
    subject: Subject, recording: Recorded, effect: Effect | None = None, place: str = "",
    values: Sequence[float] = (),
) -> Reports:  # fmt: skip
    """Return what the arm reports, with an effect in it or as the model has it."""
    if effect is None:
        return subject.nominal.run([(lambda row: None, recording)])[0]

    def enter(row: Row) -> None:
        effect.enter(row, place, np.asarray(values, np.float64))

    rollouts = Rollouts(subject.plant, effect.structure(subject, place), 1)
    return rollouts.run([(enter, recording)])[0]
