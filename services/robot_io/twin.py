"""The link to a simulated robot that keeps up with the clock."""

import structlog

from services.robot_io.links import Floats, RobotState
from shared.sim.twin import Twin

MAX_STEPS = 10
"""Control steps made up for in one read; time beyond that is lost to the twin, and counted."""
ROBOT = 1
OTHER = 0

log = structlog.get_logger()


class TwinLink:
    """The twin in real time: every read brings it up to now."""

    def __init__(self, twin: Twin) -> None:
        self._twin = twin
        self._period = twin.model.cfg.control_timestep
        self._began_at = -1.0
        self._stepped_to = -1.0
        self._at = -1.0
        self._generation = 0
        self._is_run_stopped = False
        self._is_diverged = False
        self.steps = 0
        """Control steps made."""
        self.steps_lost = 0
        """Control steps that real time was ahead of the twin by, and that were left out."""

    def read(self, now: float) -> RobotState:
        """Return the state after as many whole control steps as have passed."""
        if self._began_at < 0.0:
            self._began_at = self._stepped_to = now
        due = int((now - self._stepped_to) / self._period + 1e-3)
        if due > MAX_STEPS:
            self.steps_lost += due - MAX_STEPS
            self._stepped_to += (due - MAX_STEPS) * self._period
            due = MAX_STEPS
        for _ in range(due):
            self._twin.step()
            self._stepped_to += self._period
            self.steps += 1
        self._check()
        if not self._is_diverged:
            self._at = now
        bat = self._twin.bat(ROBOT)
        positions, velocities = self._twin.joints()
        vx, vy, vz = (float(number) for number in bat[7:10])
        return RobotState(
            at=self._at,
            tool=self._twin.tools()[ROBOT],
            speed=(vx * vx + vy * vy + vz * vz) ** 0.5,
            bat=bat,
            joints=positions[ROBOT],
            joint_velocities=velocities[ROBOT],
            joint_efforts=self._twin.efforts(ROBOT),
            force=self._twin.force(ROBOT),
            effort_share=self._twin.effort_share(ROBOT),
            is_run_stopped=self._is_run_stopped,
            are_motors_halted=self._twin.is_limp,
            generation=self._generation,
            problems=("the twin's physics diverged: restart robot_io",)
            if self._is_diverged
            else (),
        )

    def write(self, pose: Floats) -> None:
        """Give the robot's controller a new target."""
        self._twin.command(ROBOT, pose)

    def hold(self) -> None:
        """Make the robots stay where they are."""
        self._twin.latch()

    def read_other(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Return bat, tool, joints and joint velocities of the robot opposite."""
        positions, velocities = self._twin.joints()
        tool = self._twin.tools()[OTHER]
        return self._twin.bat(OTHER), tool, positions[OTHER], velocities[OTHER]

    def write_other(self, pose: Floats) -> None:
        """Give the controller of the robot opposite a new target."""
        self._twin.command(OTHER, pose)

    def place_person(self, bat: Floats) -> None:
        """Put the person's bat where it is tracked."""
        self._twin.place_person(bat)

    def press_run_stop(self) -> None:
        """Cut the motors, as the button on the robot does."""
        self._is_run_stopped = self._twin.is_limp = True

    def release_run_stop(self) -> None:
        """Give the motors back, holding where the arm is now."""
        self._twin.latch()
        self._is_run_stopped = self._twin.is_limp = False

    def restart_controller(self) -> None:
        """Restart the controller, which holds where the arm is now."""
        self._twin.latch()
        self._generation += 1

    def rates(self) -> dict[str, float]:
        """Return simulated seconds per second since the start."""
        passed = self._at - self._began_at
        factor = self.steps * self._period / passed if passed > self._period else 1.0
        return {"real_time_factor": factor}

    def counters(self) -> dict[str, int]:
        """Return the steps left out because this machine was too slow."""
        return {"twin_steps_lost": self.steps_lost}

    def close(self) -> None:
        """Nothing to let go of."""

    def _check(self) -> None:
        if not self._is_diverged and not self._twin.is_finite():
            self._is_diverged = True
            log.error("twin_diverged", step=self.steps)
