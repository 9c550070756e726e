"""The way an effect is hidden and the catalogue's way are the same physics.

These hold the generator and the catalogue against each other: where they part, one of them is
wrong. Limits are shares of what the effect changes, time steps of 1 and 2 ms included.
"""

import pytest

from tests.integration.identification.hidden.agreement import agreement

EXACT = [
    ("arm3", "command_latency", "", 0.02, 0.02),
    ("arm3", "tracker_latency", "", 0.02, 0.03),
    ("arm3", "clock_skew", "", 3000.0, 0.05),
    ("arm3", "sample_and_hold", "", 0.0523, 0.02),
    ("arm3", "setpoint_ramp", "", 0.01, 0.02),
    ("arm3", "setpoint_speed", "", 1.0, 0.02),
    ("arm3", "command_filter", "", 0.03, 0.02),
    ("arm3", "integral_action", "", 2.0, 0.05),
    ("arm3", "integral_action", "shoulder", 0.2, 0.05),
    ("arm3", "dead_band", "", 0.02, 0.05),
    ("arm3", "dead_band", "elbow", 0.01, 0.05),
    ("arm3", "velocity_feedforward", "", 1.0, 0.06),
    ("arm3", "velocity_feedforward", "elbow", 0.5, 0.06),
    ("arm3", "dropped_packets", "", 0.15, 0.02),
    ("arm3", "payload", "", 0.3, 0.02),
    ("arm3", "gravity_tilt", "", 0.05, 0.02),
    ("arm3", "inertia_error", "shoulder", 0.8, 0.02),
    ("arm3", "joint_spring", "elbow", 2.0, 0.02),
    ("arm3", "torque_bias", "shoulder", 1.0, 0.02),
    ("arm3", "cogging", "shoulder", 1.0, 0.03),
    ("arm3", "nonlinear_viscous", "elbow", 0.3, 0.03),
    ("arm3", "asymmetric_friction", "shoulder", 1.0, 0.03),
    ("arm3", "external_contact", "elbow in swings", 5.0, 0.03),
    ("arm3", "tool_offset", "", 0.01, 0.02),
    ("arm3", "tracker_frame", "", 0.01, 0.02),
    ("torque2", "torque_gain", "elbow", 0.2, 0.03),
    ("pr2", "command_frame", "", 0.01, 0.02),
    ("pr2", "sample_and_hold", "", 0.0123, 0.05),
    ("pr2", "joint_elasticity", "elbow_flex", 3e-3, 0.05),
    ("pr2", "backlash", "elbow_flex", 0.03, 0.08),
    ("pr2", "encoder_offset", "elbow_flex", 0.03, 0.1),
]
"""Arm, effect, place, size, limit."""
DRIVES = [
    ("arm3", "thermal_derating", "shoulder", 2e-3, 0.03),
    ("pr2", "thermal_derating", "shoulder_lift", 1e-3, 0.03),
    ("pr2", "torque_gain", "elbow_flex", 0.2, 0.03),
]
"""The same of drives that get their torques from a controller beside the arm."""
ALIKE = [
    ("arm3", "tracker_slip", "swings", 0.01, 0.2),  # it takes 30 ms here
    ("arm3", "counterbalance", "elbow", 0.1, 0.2),  # Coriolis torques are the catalogue's
    ("arm3", "encoder_offset", "shoulder", 0.05, 0.15),  # a controller of 1 kHz
    ("arm3", "joint_elasticity", "elbow", 6e-3, 0.15),  # another damping
    ("arm3", "base_compliance", "", 1e-3, 0.15),
    ("arm3", "backlash", "shoulder", 0.03, 0.2),
    ("arm3", "coupled_wrist", "elbow", 0.8, 0.2),  # bristles
    ("arm3", "load_friction", "shoulder", 0.2, 0.25),
    ("torque2", "coulomb_friction", "shoulder", 0.2, 0.25),
]
"""The same where the two models of an effect are not quite the same."""


@pytest.mark.parametrize(("arm", "name", "place", "size", "limit"), EXACT)
def test_both_ways_of_an_effect_move_the_arm_alike(arm, name, place, size, limit):
    found = agreement(arm, name, place, size)
    assert found.effect > 0.5
    assert found.share < limit


@pytest.mark.parametrize(("arm", "name", "place", "size", "limit"), DRIVES)
def test_both_ways_of_a_weak_drive_move_the_arm_alike(arm, name, place, size, limit):
    found = agreement(arm, name, place, size, nothing=1e-6 * size)
    assert found.effect > 0.5
    assert found.share < limit


@pytest.mark.slow
@pytest.mark.parametrize(("arm", "name", "place", "size", "limit"), ALIKE)
def test_another_model_of_an_effect_moves_the_arm_nearly_alike(arm, name, place, size, limit):
    found = agreement(arm, name, place, size)
    assert found.effect > 0.5
    assert found.share < limit
