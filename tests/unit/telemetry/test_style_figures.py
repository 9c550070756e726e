import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from shared.telemetry.style_figures import (
    SELECTED_COLOURS,
    StyleOf,
    _ellipse,
    component_panels,
    feature_panels,
)


def policies() -> list[StyleOf]:
    generator = np.random.default_rng(0)
    parts = ("selected", "selected", "selected", "warm_start", "library")
    return [
        StyleOf(f"policy {k}", part, [1.0 * k] * 8, [0.1] * 8, generator.normal(k, 1.0, (40, 3)))
        for k, part in enumerate(parts)
    ]


def test_every_feature_has_a_panel_and_every_policy_a_mark() -> None:
    titles = [f"feature {k} (m/s)" for k in range(8)]
    drawing = feature_panels(titles, policies()[:4])
    ElementTree.fromstring(drawing)
    for text in (*titles, *(policy.label for policy in policies()[:4])):
        assert text in drawing
    for colour in SELECTED_COLOURS:
        assert colour in drawing


def test_components_are_drawn_in_pairs_with_what_they_hold() -> None:
    drawing = component_panels(policies(), [0.6, 0.3, 0.09])
    ElementTree.fromstring(drawing)
    assert drawing.count("component 1 (60%)") == 2
    assert drawing.count("component 3 (9%)") == 2
    for policy in policies():
        assert policy.label in drawing


def test_the_same_data_are_the_same_text() -> None:
    assert component_panels(policies(), [0.6, 0.3]) == component_panels(policies(), [0.6, 0.3])


@pytest.mark.parametrize("angle", [0.0, 30.0, 80.0, -50.0])
def test_the_ellipse_is_one_standard_deviation_along_its_own_axes(angle: float) -> None:
    """Points on a cross, 3 along and 1 across, turned: the ellipse has their axes."""
    turn = np.deg2rad(angle)
    cross = np.array([[3.0, 0.0], [-3.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    points = cross @ np.array(
        [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
    ) + [5.0, 2.0]  # fmt: skip
    found = _ellipse(points, points.mean(axis=0), "#000000", 1.0)
    assert found.center == pytest.approx((5.0, 2.0))
    assert found.width == pytest.approx(2 * np.sqrt(18 / 3))
    assert found.height == pytest.approx(2 * np.sqrt(2 / 3))
    assert found.angle % 180.0 == pytest.approx(angle % 180.0)
