"""The eight features against analytic motions and a literal version, one trajectory at a time."""

import math
import tomllib
from importlib import resources
from typing import Any

import numpy as np
import pytest

from shared.styles.features import FEATURES, MOVING_MASS, StyleMeter

DT = 0.01
NAMES = [feature.name for feature in FEATURES]


def literal(positions: Any, velocities: Any, dt: float) -> list[float]:
    """Return the features of one trajectory, word by word from the module's docstring."""
    n = len(positions)
    a = [(velocities[k] - velocities[k - 1]) / dt for k in range(1, n)]
    j = [(a[k] - a[k - 1]) / dt for k in range(1, len(a))]
    way = [sum(abs(positions[k][i] - positions[k - 1][i]) for k in range(1, n)) for i in range(3)]
    speed = sum(math.dist(v, (0, 0, 0)) for v in velocities) / n
    squared_jerk = sum(float(np.dot(one, one)) for one in j) * dt
    energy = sum(0.5 * MOVING_MASS * float(np.dot(v, v)) * dt for v in velocities)
    dimensionless = ((n - 1) * dt) ** 3 / speed**2 * squared_jerk
    return [
        *way,
        speed,
        sum(math.dist(one, (0, 0, 0)) for one in a) / (n - 1),
        sum(math.dist(one, (0, 0, 0)) for one in j) / (n - 2),
        energy,
        -math.log(max(dimensionless, 1.0)),
    ]


def measured(positions: Any, velocities: Any, dt: float = DT) -> dict[str, float]:
    """Return the features of one trajectory float64[T, 3] that both sides follow."""
    meter = StyleMeter(1, dt)
    for position, velocity in zip(positions, velocities, strict=True):
        meter.add(
            np.tile(position.reshape(3, 1, 1), (1, 2, 1)),
            np.tile(velocity.reshape(3, 1, 1), (1, 2, 1)),
        )
    found = meter.features()
    np.testing.assert_array_equal(found[:, 0], found[:, 1])
    return dict(zip(NAMES, found[0, 0].astype(float), strict=True))


def test_random_trajectories_of_many_bouts_agree_with_the_literal_version() -> None:
    generator = np.random.default_rng(5)
    steps, worlds = 60, 7
    velocities = generator.normal(size=(steps, 3, 2, worlds))
    positions = np.cumsum(velocities, axis=0) * DT + generator.normal(size=(3, 2, worlds))
    meter = StyleMeter(worlds, DT)
    for position, velocity in zip(positions, velocities, strict=True):
        meter.add(position, velocity)
    found = meter.features()
    assert found.dtype == np.float32
    assert found.shape == (worlds, 2, len(FEATURES)) == (worlds, 2, 8)
    for world in range(worlds):
        for side in range(2):
            expected = literal(positions[:, :, side, world], velocities[:, :, side, world], DT)
            np.testing.assert_allclose(found[world, side], expected, rtol=1e-5)


def test_uniform_straight_motion_has_no_acceleration_and_the_highest_smoothness() -> None:
    seconds = np.arange(2000) * DT
    velocity = np.array([0.3, -0.4, 0.0])
    found = measured(seconds[:, None] * velocity, np.tile(velocity, (2000, 1)))
    assert found["displacement_x"] == pytest.approx(0.3 * 19.99)
    assert found["displacement_y"] == pytest.approx(0.4 * 19.99)
    assert found["displacement_z"] == 0.0
    assert found["mean_velocity"] == pytest.approx(0.5)
    assert found["mean_acceleration"] == pytest.approx(0.0, abs=1e-9)
    assert found["mean_jerk"] == pytest.approx(0.0, abs=1e-7)
    assert found["kinetic_energy"] == pytest.approx(0.5 * MOVING_MASS * 0.25 * 20.0)
    assert found["smoothness"] == 0.0


def test_a_circle_has_its_closed_form_features() -> None:
    radius, turns, steps = 0.2, 5, 2001
    duration = (steps - 1) * DT
    rate = 2 * math.pi * turns / duration
    angle = rate * np.arange(steps) * DT
    zero = np.zeros(steps)
    positions = radius * np.stack([np.cos(angle), zero, np.sin(angle)], axis=1)
    velocities = radius * rate * np.stack([-np.sin(angle), zero, np.cos(angle)], axis=1)
    found = measured(positions, velocities)
    assert found["displacement_x"] == pytest.approx(4 * radius * turns, rel=1e-3)
    assert found["displacement_z"] == pytest.approx(4 * radius * turns, rel=1e-3)
    assert found["mean_velocity"] == pytest.approx(radius * rate)
    assert found["mean_acceleration"] == pytest.approx(radius * rate**2, rel=1e-3)
    assert found["mean_jerk"] == pytest.approx(radius * rate**3, rel=1e-3)
    assert found["smoothness"] == pytest.approx(-math.log((rate * duration) ** 4), rel=1e-3)


def test_a_minimum_jerk_reach_has_the_dimensionless_jerk_of_720() -> None:
    steps, amplitude = 2001, 0.4
    duration = (steps - 1) * DT
    s = np.linspace(0.0, 1.0, steps)
    along = np.array([0.6, 0.0, 0.8])
    reach = amplitude * (10 * s**3 - 15 * s**4 + 6 * s**5)
    speed = amplitude / duration * (30 * s**2 - 60 * s**3 + 30 * s**4)
    found = measured(reach[:, None] * along, speed[:, None] * along)
    assert found["displacement_z"] == pytest.approx(0.8 * amplitude)
    assert found["mean_velocity"] == pytest.approx(amplitude / duration, rel=1e-3)
    assert found["smoothness"] == pytest.approx(-math.log(720.0), abs=0.01)


def test_energy_and_mean_speed_do_not_depend_on_the_control_period() -> None:
    coarse, fine = (
        measured(
            np.stack([np.sin(3 * t), t, t], 1), np.stack([3 * np.cos(3 * t), t**0, t**0], 1), dt
        )
        for dt in (0.01, 0.001)
        for t in [np.arange(round(10 / dt)) * dt]
    )
    for name in NAMES:
        assert coarse[name] == pytest.approx(fine[name], rel=0.01), name


def test_a_tremor_on_a_movement_makes_it_rougher_and_a_still_hand_is_smooth() -> None:
    t = np.arange(2000) * DT
    calm = np.stack([np.sin(t), np.cos(t), np.zeros_like(t)], axis=1)
    tremor = 0.05 * np.sin(2 * math.pi * 8 * t)[:, None]
    assert measured(calm, calm + tremor)["smoothness"] < measured(calm, calm)["smoothness"] - 1.0
    still = measured(np.ones((50, 3)), np.full((50, 3), 1e-9))
    assert still["smoothness"] == 0.0
    assert all(np.isfinite(value) for value in still.values())


def test_reset_begins_new_bouts_and_leaves_nothing_of_the_old() -> None:
    generator = np.random.default_rng(1)
    motion = generator.normal(size=(20, 2, 3, 2, 4))
    fresh, used = StyleMeter(4, DT), StyleMeter(4, DT)
    for position, velocity in generator.normal(size=(9, 2, 3, 2, 4)):
        used.add(position, velocity)
    used.reset()
    for position, velocity in motion:
        fresh.add(position, velocity)
        used.add(position, velocity)
    np.testing.assert_array_equal(fresh.features(), used.features())


def test_what_was_added_is_neither_kept_nor_changed() -> None:
    meter = StyleMeter(2, DT)
    position, velocity = np.ones((3, 2, 2)), np.ones((3, 2, 2))
    for step in range(5):
        position[:] = step * DT
        meter.add(position, velocity)
        assert (velocity == 1.0).all()
    assert meter.features()[0, 0, 0] == pytest.approx(4 * DT)


def test_two_steps_are_too_few_for_a_jerk() -> None:
    meter = StyleMeter(1, DT)
    for _ in range(2):
        meter.add(np.zeros((3, 2, 1)), np.zeros((3, 2, 1)))
    with pytest.raises(ValueError, match="bout of 2 steps has no jerk"):
        meter.features()
    with pytest.raises(ValueError, match="timestep"):
        StyleMeter(1, 0.0)


def test_the_moving_mass_is_the_gripper_and_the_bat_of_the_nominal_model() -> None:
    data = resources.files("shared.sim") / "data"
    arm = tomllib.loads((data / "pr2_arm.toml").read_text())
    bat = tomllib.loads((data / "nominal.toml").read_text())["bat"]
    links = [link for link in arm["links"] if link["name"].startswith("gripper_")]
    assert len(links) == 5
    assert pytest.approx(sum(link["mass_kg"] for link in links) + bat["mass"]) == MOVING_MASS
