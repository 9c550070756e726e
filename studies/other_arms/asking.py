"""Makes a data set and asks what is wrong with it."""

import tempfile
from pathlib import Path

from shared.identification.conclusion.sentence import as_told
from shared.identification.dataset.reading import read_dataset
from shared.identification.find import identify
from studies.other_arms.drawn import arm_named
from studies.other_arms.recording import convert


def asked(job: tuple[str, str, int, float]) -> str:
    """Return a line: what was wrong, and what is said of it."""
    name, wrong, seed, seconds = job
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        fault = convert(data, arm_named(name, seed), wrong, seconds, seed)
        verdict = identify(read_dataset(data), seed=seed).verdict
    causes = map(as_told, verdict.causes)
    said = [f"{each.effect} {each.where} {each.value:.4g} {each.unit}" for each in causes]
    said += [
        "tie: " + " or ".join(f"{each.effect} {each.where}" for each in tie.causes)
        for tie in verdict.ties
    ]
    held = verdict.held_out
    step = "" if verdict.timestep is None else f"{1e3 * verdict.timestep:g} ms, "
    stages = f"{held.nominal:.3g} {held.base_fit:.3g} {held.extended:.3g}"
    return (
        f"{name} {wrong} {seed} | {fault} | {verdict.verdict} {'; '.join(said)} | "
        f"{stages} | {step}{verdict.cpu_s:.0f} CPU s"
    )
