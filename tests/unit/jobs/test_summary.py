from services.jobs.report.summarise import BIN_BOUTS, bins
from services.league.history import CurvePoint


def points(*bouts: int) -> list[CurvePoint]:
    return [
        CurvePoint(update, total_samples=0, at_ns=0, score=[0.0] * count)
        for update, count in enumerate(bouts)
    ]


def test_a_curve_keeps_every_point_in_its_order():
    for counts in ((1,), (BIN_BOUTS, 1), (BIN_BOUTS, BIN_BOUTS, 1), (1, 1, 1), (BIN_BOUTS,) * 5):
        found = [point.update for part in bins(points(*counts)) for point in part]
        assert found == list(range(len(counts))), counts


def test_what_is_left_over_joins_the_last_whole_part():
    parts = bins(points(BIN_BOUTS, BIN_BOUTS, 1))
    assert [len(part) for part in parts] == [1, 2]


def test_no_points_make_no_parts():
    assert bins([]) == []
