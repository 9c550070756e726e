"""Makes the plan of a session from the study's folder."""

from services.study.config import StudyConfig
from services.study.plan import SessionPlan
from shared.errors import ConfigError
from shared.runtime.build import commit
from shared.runtime.service import version
from shared.study.events import SessionBegan, SessionResumed
from shared.study.folder import Study, hash_of


def plan_of(study: Study, cfg: StudyConfig, settings: bytes, session: int = 1) -> SessionPlan:
    """Return the plan of a participant's session.

    Args:
        study: whose protocol and orders are used.
        cfg: names the participant and the players.
        settings: the resolved settings of all processes, whose hash every row carries.
        session: its number, from 1.

    Raises:
        StudyError: nobody of that name is expected, or there is no key.
        ConfigError: no participant is named.
    """
    if not cfg.participant:
        raise ConfigError("study.participant is empty: name one of the allocation, such as sub-01")
    labels = study.labels_of(cfg.participant)
    config, source = hash_of(settings), commit()
    return SessionPlan(
        participant=cfg.participant,
        session=session,
        protocol=study.protocol,
        steps=study.steps_of(cfg.participant),
        labels={name: label for label, name in study.conditions.items()},
        antagonist=cfg.antagonist,
        players=dict(cfg.players),
        began=SessionBegan(
            participant=cfg.participant, session=session, order=labels,
            study=study.protocol.name, protocol=study.protocol_hash, config=config,
            commit=source, version=version(),
        ),
        resumed=SessionResumed(config=config, commit=source, version=version()),
    )  # fmt: skip
