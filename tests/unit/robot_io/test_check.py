"""The list that a person sees before arming."""

import math

import msgspec
import numpy as np

from services.robot_io.limits import Space
from services.robot_io.poses import Pose
from services.robot_io.scene import blade_of
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from tests.unit.robot_io.gates import START, Driven
from tests.unit.robot_io.looping import Looping


def test_everything_that_must_be_so_before_arming_is_listed_and_nothing_changes():
    loop = Looping().tick(3)
    before = loop.service.health().state
    reply = loop.ask("check")
    assert reply.accepted
    assert reply.reasons == ()
    assert reply.passed == (
        "the gate is disarmed",
        "the run stop is released",
        "the motors are on",
        "the robot's state is fresh (within 0.05 s)",
        "the tool's measured pose is a pose",
        "the policy answers (within 0.1 s)",
        "the other bat is tracked (within 0.1 s)",
        "the robot stands still (at most 0.02 m/s)",
        "the tool and its bat are inside their space",
    )
    assert loop.service.health().state == before
    assert loop.ask("arm").accepted


def test_what_is_not_so_is_a_reason_and_the_rest_stays_listed():
    loop = Looping().armed()
    loop.link.press_run_stop()
    loop.offset = None
    loop.tick(15)
    reply = loop.ask("check")
    assert not reply.accepted
    assert reply.mode == "tripped"
    assert reply.reasons[0].startswith("the gate has tripped (the run stop was pressed)")
    assert "the run stop is pressed" in reply.reasons
    assert "no usable command from the policy within 0.1 s: is it running?" in reply.reasons
    assert "the other bat is tracked (within 0.1 s)" in reply.passed
    assert loop.ask("arm").reasons == reply.reasons


def test_each_thing_is_either_passed_or_a_reason():
    gate = Driven().step()
    inputs = gate.inputs(
        measured=Pose((math.nan, 0.0, 0.0), START.orientation),
        speed=math.nan,
        is_tracked=False,
        are_motors_halted=True,
        state_at=0.0,
        problems=("the calibration is too old: repeat it",),
    )
    checks = gate.gate.checks(gate.memory, inputs)
    assert [check.what for check in checks if not check.problem] == [
        "the gate is disarmed", "the run stop is released", "the policy answers (within 0.1 s)",
    ]  # fmt: skip
    assert len([check for check in checks if check.problem]) == 6
    assert gate.gate.obstacles(gate.memory, inputs) == tuple(
        check.problem for check in checks if check.problem
    )


def test_a_reset_puts_a_simulated_arm_back_where_it_may_be_armed():
    loop = Looping().armed()
    home = loop.tool[:3].copy()
    loop.offset = np.array([0.0, 0.0, 0.0375, 0.0, 0.0, 0.0])
    loop.tick(100)
    loop.link.press_run_stop()
    loop.tick(2)
    assert np.linalg.norm(loop.tool[:3] - home) > 0.05
    assert not loop.ask("reset").accepted
    assert np.linalg.norm(loop.tool[:3] - home) > 0.05
    loop.link.release_run_stop()
    loop.offset = np.zeros(6)
    loop.tick(2)
    assert loop.ask("reset").mode == "disarmed"
    loop.tick(3)
    assert np.linalg.norm(loop.tool[:3] - home) < 0.01
    assert loop.ask("arm").accepted


def test_a_simulated_arm_that_was_shut_outside_its_space_is_put_back_when_a_person_arms():
    loop = Looping().armed()
    home = loop.tool[:3].copy()
    loop.offset = np.array([0.0375, 0.0, 0.0, 0.0, 0.0, 0.0])
    loop.tick(300)
    assert loop.ask("disarm").mode == "disarmed"
    gate = loop.parts.gate
    edge = float(loop.tool[0]) - 0.001  # as if it had swung a millimetre too far
    smaller = msgspec.structs.replace(gate.cfg, box_high=(edge, *gate.cfg.box_high[1:]))
    gate.space = Space(smaller, blade_of(FencingModel.build(SimConfig())))
    loop.tick(20)
    refused = loop.ask("arm")
    assert not refused.accepted
    assert refused.reasons == (
        "the simulated arm stood outside its space and is en garde: arm again",
    )
    loop.offset = np.zeros(6)
    loop.tick(5)
    assert np.linalg.norm(loop.tool[:3] - home) < 0.01
    assert loop.ask("arm").accepted
