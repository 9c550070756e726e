"""Hides effects in a robot, records it, and writes the data set with the truth beside it."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from shared.identification.dataset.reading import read_dataset
from shared.identification.dataset.types import POSE, Dataset, ModelSource
from shared.identification.dataset.writing import write_dataset
from shared.identification.hidden.choosing import Chosen, Factory, choose
from shared.identification.hidden.recipe import Recipe
from shared.identification.hidden.recording import plans, record
from shared.identification.hidden.truth import FILE as TRUTH_FILE
from shared.identification.hidden.truth import HiddenEffect, HiddenQuantity, Truth, truth_text
from shared.sim.hidden import spread
from shared.sim.hidden.arms import ARMS
from shared.sim.hidden.effect import Scene


def hide(folder: Path, recipe: Recipe) -> Dataset:
    """Write a data set with something hidden in it, and return it as a finder reads it.

    Args:
        folder: new or empty; ``truth.toml`` will say what was hidden.
        recipe: what is wanted; everything random comes from its seed.

    Raises:
        IdentificationError: something cannot be hidden there, or the folder cannot be written.
    """
    dataset, truth = simulated(recipe)
    files = {TRUTH_FILE: truth_text(truth).encode()}
    arm = ARMS[recipe.arm]
    if arm.file is not None:
        files[arm.file.name] = arm.file.read_bytes()
        source = replace(dataset.source, path=folder / arm.file.name)
        dataset = replace(dataset, source=source)
    write_dataset(dataset, folder, {"name": "riposte identify simulate"}, files)
    return read_dataset(folder)


def simulated(recipe: Recipe) -> tuple[Dataset, Truth]:
    """Return a data set that is not written anywhere, and the truth about it."""
    arm = ARMS[recipe.arm]
    rng = np.random.default_rng([recipe.seed, 5])
    made = plans(recipe, arm, np.random.default_rng([recipe.seed, 1]))
    scene = Scene(
        arm,
        tuple(plan.name for plan in made),
        tuple(plan.name for plan in made if plan.split == "train"),
        recipe.seconds,
    )
    own = spread.draw(
        arm, recipe.spread, recipe.is_imperfect, np.random.default_rng([recipe.seed, 2])
    )
    factory = Factory(recipe, arm, own, scene)
    chosen = choose(factory, made, rng)
    robot = factory.make([each.case for each in chosen])
    trajectories = tuple(record(recipe, robot, arm, plan) for plan in made)
    dataset = Dataset(
        folder=Path(),
        source=ModelSource("pr2") if arm.file is None
        else ModelSource("mjcf", path=arm.file, tracked=arm.tracked),
        control=arm.control,
        joints=arm.joints,
        actuators=POSE if arm.control == "pose" else arm.joints,
        trajectories=trajectories,
        caveats=(),
        hash="",
    )  # fmt: skip
    truth = Truth(
        arm=recipe.arm, seed=recipe.seed, is_imperfect=recipe.is_imperfect,
        is_gentle=recipe.is_gentle, has_tracker=recipe.has_tracker, timestep=recipe.timestep,
        effect=tuple(_described(each) for each in chosen),
        base={
            "damping": own.damping.tolist(), "armature": own.armature.tolist(),
            "friction": own.friction.tolist(), "kp": own.kp.tolist(), "kv": own.kv.tolist(),
            "mass": own.mass.tolist(), "inertia": own.inertia.tolist(),
        },
    )  # fmt: skip
    return dataset, truth


def _described(chosen: Chosen) -> HiddenEffect:
    hidden, case = chosen.hidden, chosen.case
    return HiddenEffect(
        name=hidden.name,
        where=case.place,
        quantities=tuple(
            HiddenQuantity(name=name, value=float(value), unit=unit)
            for name, (value, unit) in hidden.values(case).items()
        ),
        way=hidden.way,
        share=chosen.share,
    )
