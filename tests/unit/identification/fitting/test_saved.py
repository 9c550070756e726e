"""A base fit kept on disk is used for the same data, model and seed only."""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from shared.identification.catalogue.viscous_friction import EFFECT as VISCOUS
from shared.identification.dataset.types import Dataset
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.saved import FILE, SCHEMA, fits_of, load, save
from shared.identification.fitting.space import Space
from shared.identification.progress import silent
from shared.identification.search.begin import begin
from shared.identification.search.rounds import search
from shared.identification.search.searched import Search
from shared.sim.plant.row import Row
from tests.measured import measure
from tests.searches import ELBOW, Searches

_ODD_BYTES = (b"", b"{", b"null", b"[1, 2]", b"\xff\xfe", b'{"dataset": "\xff"}')


@pytest.fixture
def kept(tmp_path: Path) -> Dataset:
    """Return the data whose base fit is in the folder."""
    searches = Searches(tmp_path)
    save(tmp_path, searches.problem.dataset, 7, searches.search(np.ones(4)))
    return searches.problem.dataset


def test_what_was_saved_is_what_is_loaded(tmp_path: Path, kept: Dataset):
    found = load(tmp_path, kept, 7)
    assert found is not None
    assert len(found.names) == len(found.parts) == len(found.whole) == 18
    assert found.starts_agree


def test_other_data_another_seed_or_another_model_have_no_base_fit(tmp_path: Path, kept: Dataset):
    assert load(tmp_path, replace(kept, hash="other"), 7) is None
    assert load(tmp_path, kept, 8) is None
    assert load(tmp_path, replace(kept, source=replace(kept.source, tracked="")), 7) is None
    assert load(tmp_path / "nowhere", kept, 7) is None


def test_a_search_that_took_all_back_is_kept_by_its_base(tmp_path: Path):
    searches = Searches(tmp_path)
    found = searches.search(np.ones(4))
    with_cause = Space(searches.parts.space.problem, (ELBOW,))
    begun = np.r_[searches.base.z, 0.5]
    found.parts = Fit.at(with_cause, begun, with_cause.problem.of("train"))
    fits = fits_of(found)
    assert len(fits.names) == len(fits.parts) == len(fits.whole) == 18


def test_another_schema_or_a_number_too_few_is_no_base_fit(tmp_path: Path, kept: Dataset):
    whole = msgspec.json.decode((tmp_path / FILE).read_bytes())
    for change in ({"schema": SCHEMA + 1}, {"whole": whole["whole"][1:]}, {"seed": "seven"}):
        (tmp_path / FILE).write_bytes(msgspec.json.encode({**whole, **change}))
        assert load(tmp_path, kept, 7) is None


@pytest.mark.parametrize("data", _ODD_BYTES)
def test_a_damaged_file_is_no_base_fit(tmp_path: Path, kept: Dataset, data: bytes):
    (tmp_path / FILE).write_bytes(data)
    assert load(tmp_path, kept, 7) is None


def test_a_search_that_goes_on_ends_as_the_first(tmp_path: Path):
    def rub(row: Row) -> None:
        VISCOUS.enter(row, "elbow", np.array([1.0]))

    dataset = measure(tmp_path, np.random.default_rng(1), rub, seconds=2.5)

    def started() -> Search:
        return begin(
            dataset, seed=3, progress=silent, without=frozenset(), catalogue=(VISCOUS,),
            fits=load(tmp_path, dataset, 3),
        )  # fmt: skip

    first = started()
    save(tmp_path, dataset, 3, first)
    again = started()
    assert np.array_equal(first.base.z, again.base.z)
    assert np.array_equal(first.base.jacobian, again.base.jacobian)
    assert np.array_equal(first.nominal.jacobian, again.nominal.jacobian)
    assert first.base_losses.tolist() == again.base_losses.tolist()
    for found in (first, again):
        search(found, silent)
    assert first.tried.keys() == again.tried.keys()
    for label, tried in first.tried.items():
        assert tried.gain == again.tried[label].gain
