"""The default site file, written from the structs that declare it: ``make docs``.

``python -m services.jobs.site`` prints it; ``deploy/local.toml`` is its output, and a test keeps
the two the same.
"""

import ast
import importlib
import inspect
import itertools
import json
import re
import sys
import textwrap
from collections.abc import Sequence
from typing import Any, cast

import msgspec
import tomli_w

DECLARED = {
    "bus": "shared.bus.config:BusConfig",
    "sim": "shared.sim.config:SimConfig",
    "game": "shared.game.rules:RuleBook",
    "action": "shared.policy.action:ActionConfig",
    "reward": "shared.game.reward:RewardConfig",
    "league": "services.league.config:LeagueConfig",
    "learner": "services.learner.config:LearnerConfig",
    "actor": "services.actor.config:ActorConfig",
    "recorder": "services.recorder.config:RecorderConfig",
    "policy": "services.policy.config:PolicyConfig",
    "referee": "services.referee.config:RefereeConfig",
    "robot_io": "services.robot_io.config:RobotIoConfig",
    "safety": "services.robot_io.config:SafetyConfig",
    "pr2": "services.robot_io.pr2.config:Pr2Config",
    "vive": "services.robot_io.vive.config:ViveConfig",
    "heart_rate": "services.robot_io.heart_rate.source:HeartRateConfig",
    "tones": "services.robot_io.tones.tones:TonesConfig",
    "page": "services.page.config:PageConfig",
    "study": "services.study.config:StudyConfig",
    "metrics": "services.metrics.config:MetricsConfig",
    "play": "services.jobs.play.config:PlayConfig",
    "train": "services.jobs.settings:TrainConfig",
    "site": "services.jobs.up:SiteConfig",
}
"""Where each section of a site file is declared."""

WIDTH = 100
HEAD = """\
Default site file: everything on this machine, its values the defaults. SI units unless a name
says otherwise. Copy it, keep the lines you change: what a file leaves out has its default.
Written by `make docs` from the structs that declare the sections."""


def section_types() -> dict[str, type[msgspec.Struct]]:
    """Return the struct of every section, by name."""
    return {name: _load(where) for name, where in DECLARED.items()}


def field_docs(struct: type[msgspec.Struct]) -> dict[str, str]:
    """Return the docstrings below a struct's fields, each on one line."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(struct)))
    body = cast(ast.ClassDef, tree.body[0]).body
    docs: dict[str, str] = {}
    for field, after in itertools.pairwise(body):
        match field, after:
            case (
                ast.AnnAssign(target=ast.Name(id=name)),
                ast.Expr(value=ast.Constant(value=str(text))),
            ):
                docs[name] = " ".join(text.split())
            case _:
                pass
    return docs


def template() -> str:
    """Return the text of the default site file."""
    parts = [_comment(" ".join(HEAD.split()))]
    for name, struct in section_types().items():
        about = inspect.cleandoc(struct.__doc__ or "").split("\n\n")[0]
        parts.append(f"\n{_comment(' '.join(about.split()))}\n[{name}]")
        docs = field_docs(struct)
        values: dict[str, Any] = msgspec.to_builtins(struct())
        for key, value in values.items():
            text = [_comment(docs[key])] if key in docs else []
            parts.append("\n".join([*text, _assignment(key, value)]))
    return "\n".join(parts) + "\n"


def main(argv: Sequence[str] | None = None) -> int:
    """Print the default site file."""
    del argv
    sys.stdout.write(template())
    return 0


def _load(where: str) -> type[msgspec.Struct]:
    module, _, name = where.partition(":")
    return getattr(importlib.import_module(module), name)


def _assignment(key: str, value: object) -> str:
    if value is None:
        return f"# {key} ="
    if isinstance(value, list | tuple):
        return f"{key} = {json.dumps(value)}"  # plain lists are the same text in both
    return tomli_w.dumps({key: value}).strip()


def _comment(text: str) -> str:
    text = re.sub(r" \(section [^)]*\)", "", text).replace("``", "")
    return "\n".join(textwrap.wrap(text, WIDTH, initial_indent="# ", subsequent_indent="# "))


if __name__ == "__main__":
    sys.exit(main())
