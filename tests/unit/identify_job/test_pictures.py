"""Pictures of a verdict: what may be shown as a multiple of its nominal value."""

import msgspec

from services.jobs.identify.pictures import base
from shared.identification.verdict import BaseValue, Interval
from tests.unit.identify_job.examples import example


def test_where_a_centre_of_mass_is_has_no_multiple():
    verdict = example("named").verdict
    centre = BaseValue(
        name="centre_y elbow", unit="m", nominal=0.001, base_fit=0.004, extended=0.004,
        interval=Interval(low=0.003, high=0.005),
    )  # fmt: skip
    picture = base(msgspec.structs.replace(verdict, base=(*verdict.base, centre)))
    assert picture is not None
    assert "damping" in picture.svg
    assert "centre_y" not in picture.svg
    assert base(msgspec.structs.replace(verdict, base=(centre,))) is None
