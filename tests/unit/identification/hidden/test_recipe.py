import pytest

from shared.errors import IdentificationError
from shared.identification.hidden.recipe import Recipe, Wish, wish_of


@pytest.mark.parametrize(
    ("text", "wish"),
    [
        ("payload", Wish("payload")),
        ("payload=0.3", Wish("payload", None, 0.3)),
        ("backlash@elbow", Wish("backlash", "elbow")),
        ("external_contact@elbow in swings=2", Wish("external_contact", "elbow in swings", 2.0)),
    ],
)
def test_an_effect_is_asked_for_by_name_place_and_size(text, wish):
    assert wish_of(text) == wish


def test_an_unknown_effect_is_refused_with_the_list_of_those_there_are():
    with pytest.raises(IdentificationError, match=r"paylaod.*payload.*torque_bias"):
        wish_of("paylaod=1")


def test_a_size_that_is_no_number_is_refused():
    with pytest.raises(IdentificationError, match="no number"):
        wish_of("payload=heavy")


@pytest.mark.parametrize(
    "wrong", [{"seconds": 0.1}, {"train": 0}, {"test": 0}, {"random": 9}, {"seed": -1}]
)
def test_a_recipe_out_of_range_is_refused(wrong):
    with pytest.raises(IdentificationError, match="must be between"):
        Recipe(**wrong)
