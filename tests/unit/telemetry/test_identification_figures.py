"""Figures of identification: what they are given they can draw."""

import re
import warnings

import numpy as np

from shared.telemetry.identification_diagnostics import Line, Row, candidates, lags, spectrum
from shared.telemetry.identification_figures import (
    plain,
    residuals_by_joint,
    stages_against_noise,
    timeline,
)


def test_names_are_no_formulas_and_not_too_long() -> None:
    assert plain("$x_1$") == r"\$x_1\$"
    assert len(plain("x" * 100)) == 26
    assert plain("_hidden").endswith("_hidden")
    assert not plain("_hidden").startswith("_")
    assert "\a" not in plain("bell\a")


def test_a_formula_that_is_none_is_drawn_as_it_is() -> None:
    drawing = residuals_by_joint(
        ["$\\frac{$", "b"], {"nominal": np.array([1.0, 2.0])}, np.array([0.1, 0.1]), "mrad"
    )
    assert "frac{$" in drawing


def test_letters_that_the_font_lacks_are_drawn_without_a_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "関節" in lags({"関節": 3.0})


def test_each_stage_has_its_number() -> None:
    drawing = stages_against_noise({"nominal": 117.2, "base_fit": 24.9, "extended": 1.04})
    assert all(text in drawing for text in (">117<", ">24.9<", ">1.04<", ">extended<"))


def test_candidates_without_a_refit_are_told_from_those_with_one() -> None:
    rows = [
        Row("coulomb_friction", "elbow", 0.6, 5.0, 4.0, 6.0, is_named=True, is_tied=False),
        Row("payload", "", 0.1, None, None, None, is_named=False, is_tied=False),
    ]
    assert candidates(rows).count("not refitted") == 1
    assert "not refitted" in candidates(rows[1:])


def test_nothing_at_all_in_a_band_is_drawn_as_nothing() -> None:
    line = Line("a", np.array([0.5, 2.0, 20.0]), np.array([0.1, 0.0, 0.0]))
    assert "<svg" in spectrum([line], "residual")
    assert "<svg" in spectrum([Line("b", line.x, np.zeros(3))], "residual")


def test_a_timeline_marks_what_was_located() -> None:
    edges, values = np.linspace(0.0, 4.0, 9), np.ones(8)
    drawing = timeline([("run 1", edges, values)], [(0, 1.0, 2.0, "A")])
    assert ">A<" in drawing
    assert ">run 1<" in drawing


def test_marks_of_a_timeline_stand_apart() -> None:
    edges, values = np.linspace(0.0, 4.0, 9), np.ones(8)
    spans = [(0, 1.0, 1.02, "A"), (0, 1.01, 1.03, "B"), (0, 3.0, 3.2, "C")]
    drawing = timeline([("run 1", edges, values)], spans)
    at = {mark: _place_of(drawing, mark) for mark in "ABC"}
    assert at["B"] - at["A"] > 6.0  # points
    assert at["C"] - at["B"] > 100.0


def _place_of(drawing: str, text: str) -> float:
    found = re.search(rf'<text [^>]* x="([0-9.]+)"[^>]*>{text}<', drawing)
    assert found is not None
    return float(found[1])


def test_nothing_is_late_by_less_than_nothing() -> None:
    assert ">0.0<" in lags({"elbow": -0.01, "wrist": 12.0})
