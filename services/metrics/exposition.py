"""Prometheus' text format, version 0.0.4: families of samples in, bytes out."""

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Literal

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"

Kind = Literal["gauge", "counter"]


@dataclasses.dataclass(frozen=True)
class Family:
    """What a metric is: one line of ``# HELP`` and one of ``# TYPE``."""

    name: str
    kind: Kind
    about: str


@dataclasses.dataclass(frozen=True)
class Sample:
    """One number of a family."""

    family: Family
    labels: Mapping[str, str]
    value: float


def render(families: Iterable[Family], samples: Iterable[Sample]) -> bytes:
    """Return the page: every family that has samples, in the order of ``families``."""
    lines: dict[str, list[str]] = {}
    for sample in samples:
        name = sample.family.name
        labels = ",".join(f'{key}="{_escaped(text)}"' for key, text in sample.labels.items())
        told = f"{{{labels}}}" if labels else ""
        lines.setdefault(name, []).append(f"{name}{told} {float(sample.value)!r}\n")
    parts: list[str] = []
    for family in families:
        if (own := lines.get(family.name)) is not None:
            parts.append(f"# HELP {family.name} {family.about}\n")
            parts.append(f"# TYPE {family.name} {family.kind}\n")
            parts += own
    return "".join(parts).encode("utf-8", "replace")


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
