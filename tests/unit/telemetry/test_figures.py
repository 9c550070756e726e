import xml.etree.ElementTree as ElementTree

import pytest

from shared.telemetry.figures import (
    Panel,
    Segment,
    StageCurve,
    learning_curve,
    scene_drawing,
    training_panels,
)

CURVES = [
    StageCurve(
        "antagonist", "antagonist learns (1)", 0.0, 1e6,
        [1e5, 9e5], [-500, 900], [-600, 800], [-400, 1000],
    ),
    StageCurve("protagonist", "protagonist learns (1)", 1e6, 2e6, [1.5e6], [300], [200], [400]),
    StageCurve("antagonist", "antagonist learns (2)", 2e6, 2.1e6, [], [], [], []),
]  # fmt: skip


@pytest.mark.parametrize("curves", [CURVES, []])
def test_a_learning_curve_is_a_drawing_that_names_its_stages(curves: list[StageCurve]) -> None:
    drawing = learning_curve(curves, "samples")

    ElementTree.fromstring(drawing)
    for curve in curves:
        assert curve.label in drawing


def test_the_same_data_are_the_same_text() -> None:
    assert learning_curve(CURVES, "samples") == learning_curve(CURVES, "samples")


def test_ink_and_agents_follow_the_pages_colours() -> None:
    drawing = learning_curve(CURVES, "samples")

    for variable in ("--ink", "--soft", "--grid", "--antagonist", "--protagonist"):
        assert f"var({variable}" in drawing or variable == "--ink"
    assert "#010203" not in drawing
    assert "#040506" not in drawing


def test_panels_draw_what_there_is() -> None:
    panels = [
        Panel("KL", [("antagonist", [0.0, 1.0], [0.01, 0.02]), ("protagonist", [], [])], zero=True),
        Panel("nothing yet", []),
    ]

    drawing = training_panels(panels, "minutes")

    ElementTree.fromstring(drawing)
    assert "nothing yet" in drawing


def test_a_scene_is_drawn_without_a_renderer() -> None:
    segments = [
        Segment("antagonist", [[1.0, 0.0, 1.0], [0.5, 0.1, 1.1]]),
        Segment("antagonist", [[0.5, 0.1, 1.1], [0.0, 0.0, 1.2]], blade=True),
    ]

    ElementTree.fromstring(scene_drawing(segments, [0.0, 0.0, 1.05], 0.2))
