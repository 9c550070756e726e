import pytest

from services.referee.config import RefereeConfig


@pytest.mark.parametrize(
    ("fields", "named"),
    [
        ({"stale_after": 0.0}, "stale_after"),
        ({"stale_after": float("nan")}, "stale_after"),
        ({"stale_after": 0.5, "void_after": 0.5}, "void_after"),
        ({"resume_after": -0.1}, "resume_after"),
    ],
)
def test_a_limit_out_of_range_is_named(fields: dict[str, float], named: str):
    with pytest.raises(ValueError, match=f"^{named}"):
        RefereeConfig(**fields)
