"""What laws get to look at."""

import numpy as np
import pytest

from shared.sim.plant.step import Moment, Step, rows_of


@pytest.fixture
def moment() -> Moment:
    speeds = np.arange(8.0).reshape(4, 2)
    return Moment(
        time=0.5, timestep=0.002, q=speeds + 10.0, qd=speeds, qd_before=speeds - 0.004,
        drive=speeds + 20.0, drive_change=speeds + 30.0, gravity=speeds + 40.0,
        rotors=np.full((4, 2), 0.1),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("indices", "rows"), [([2], slice(2, 3)), ([1, 2, 3], slice(1, 4)), ([], None), ([1, 3], None)]
)
def test_rows_that_follow_each_other_are_a_slice(indices: list[int], rows: slice | None):
    found = rows_of(indices)
    if rows is None:
        assert isinstance(found, np.ndarray)
        assert found.tolist() == indices
    else:
        assert found == rows


@pytest.mark.parametrize("indices", [[1, 2], [1, 3]])
def test_a_law_sees_the_arms_that_it_acts_on(moment: Moment, indices: list[int]):
    step = Step(moment, rows_of(indices))
    assert (step.time, step.timestep) == (0.5, 0.002)
    np.testing.assert_array_equal(step.q, moment.q[indices])
    np.testing.assert_array_equal(step.qd, moment.qd[indices])
    np.testing.assert_array_equal(step.drive, moment.drive[indices])
    np.testing.assert_array_equal(step.drive_change, moment.drive_change[indices])
    np.testing.assert_array_equal(step.gravity, moment.gravity[indices])


def test_gears_do_not_transmit_what_turns_the_rotors(moment: Moment):
    """A rotor of 0.1 kg m^2 that gets faster by 0.004 rad/s in 2 ms takes 0.2 N m."""
    step = Step(moment, rows_of([0, 2]))
    np.testing.assert_allclose(step.load, moment.drive[[0, 2]] - 0.2)
