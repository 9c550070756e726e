from pathlib import Path

import msgspec
import pytest

from services.jobs.settings import Settings
from services.jobs.site import field_docs, section_types, template
from shared.config.site import SECTIONS, load_section

DEPLOY = Path(__file__).resolve().parents[3] / "deploy"
LOCAL = DEPLOY / "local.toml"


def test_every_section_is_declared():
    assert set(section_types()) == set(SECTIONS)


def test_the_default_site_file_is_current():
    assert LOCAL.read_text(encoding="utf-8") == template(), "renew it with make docs"


@pytest.mark.parametrize("section", SECTIONS)
def test_the_default_site_file_says_the_defaults(section: str):
    struct = section_types()[section]
    assert load_section(LOCAL, section, struct) == struct()


def test_the_site_file_for_a_graphics_card_learns_from_one_rollout_of_all_its_worlds():
    settings = Settings.load(DEPLOY / "card.toml")
    assert (settings.actor.backend, settings.learner.device) == ("warp", "cuda")
    rollout = settings.actor.num_envs * settings.actor.rollout_steps
    assert settings.learner.batch_samples == rollout * settings.train.actors
    assert settings.league.batch_rollouts == 1


def test_a_field_keeps_its_docstring_on_one_line():
    class Section(msgspec.Struct):
        speed: float = 1.0
        """Of the tip
        (m/s)."""
        bare: int = 0
        other: int = 0

    assert field_docs(Section) == {"speed": "Of the tip (m/s)."}
