from typing import Any

import pytest

from services.page.config import PageConfig


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"host": ""}, "host is empty: name an interface, such as 127.0.0.1"),
        ({"port": 70000}, "port is 70000; allowed are 0 to 65535"),
        ({"max_speed": float("nan")}, "max_speed is nan; allowed are 0.1 to 4"),
        ({"countdown": -1.0}, "countdown is -1"),
        ({"origins": ("lab-pc:8765",)}, "expected such as http://lab-pc:8765"),
        ({"players": ()}, "players needs at least one pair"),
        ({"players": (("a", "x"), ("a", "y"))}, "a name, unlike others"),
        ({"players": (("a", ""),)}, "players needs"),
        ({"antagonist": "scripted:stab"}, "whoever has the mouse is a person"),
        ({"antagonist": "", "pointer": False}, "antagonist is empty"),
    ],
)
def test_what_cannot_be_is_refused_with_what_can(settings: dict[str, Any], message: str):
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        PageConfig(**settings)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
