import math

from shared.telemetry.seed_curves import SeedCurve, Shade, seed_curves


def test_a_run_is_one_line_broken_between_its_stages():
    curve = SeedCurve.joined("seed 0", [([1.0, 2.0], [10.0, 20.0]), ([], []), ([3.0], [30.0])])
    assert list(curve.x) == [1.0, 2.0, 2.0, 3.0, 3.0]
    assert [value for value in curve.mean if not math.isnan(value)] == [10.0, 20.0, 30.0]


def test_the_picture_is_the_same_for_the_same_data():
    curves = [SeedCurve("seed 0", [0.0, 1e6], [0.0, 1900.0]), SeedCurve("seed 1", [], [])]
    shades = [Shade("antagonist", "antagonist 1 learns", 0.0, 1e6)]
    picture = seed_curves(curves, shades, "samples")
    assert picture.startswith(b"\x89PNG")
    assert picture == seed_curves(curves, shades, "samples")
