from pathlib import Path

from benchmarks.identification.explainable import explainable
from benchmarks.identification.protocol import smoke
from shared.identification.catalogue import effects
from shared.identification.hidden.generator import hide
from shared.identification.hidden.truth import read_truth
from shared.identification.progress import silent
from shared.identification.search.begin import begin


def test_what_a_hidden_effect_takes_off_is_known_without_a_search(tmp_path: Path):
    recipe = smoke()[0].recipe
    dataset = hide(tmp_path / "data", recipe)
    (hidden,) = read_truth(tmp_path / "data").effect
    found = begin(
        dataset, seed=recipe.seed, progress=silent, without=frozenset(), catalogue=effects()
    )
    share = explainable(found, hidden)
    assert hidden.share is not None
    assert 0.5 * hidden.share < share < 1.0
