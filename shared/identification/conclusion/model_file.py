"""The extended model as a file: ``model.toml`` of a PR2, ``model.xml`` of any other arm.

What a cause changes of the physics is found by letting it into an arm and looking: fields of the
compiled model go into the file, a torque law or a changed log cannot.
"""

import dataclasses
from collections.abc import Callable, Sequence, Sized
from dataclasses import dataclass
from typing import cast

import msgspec
import numpy as np
from numpy.typing import NDArray

from shared.errors import IdentificationError
from shared.identification.arm.subject import Subject, recorded_of, subject_of
from shared.identification.catalogue import effects
from shared.identification.dataset.types import (
    Dataset,
    Float64,
    with_timestep,
    without_limits,
)
from shared.identification.effect import Effect, Quantity
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.shown import if_shown
from shared.identification.verdict import Cause, Verdict
from shared.sim.parameters import Measured, dump_parameters, load_parameters
from shared.sim.plant.export import patched_xml
from shared.sim.plant.pr2_parameters import FIELDS, pr2_parameters
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure
from shared.telemetry.wording import listing

_NATIVE = {"fields", "rests"}
"""What of a row an MJCF can say."""
_FIELD_WORDS = {
    "dof_damping": "damping",
    "dof_dampingpoly": "damping",
    "dof_frictionloss": "friction loss",
    "dof_armature": "armature",
    "jnt_actfrcrange": "torque limit",
    "jnt_stiffness": "spring",
    "actuator_gainprm": "gains",
    "actuator_biasprm": "gains",
    "body_mass": "mass",
    "body_inertia": "inertia",
    "opt.gravity": "gravity",
}


@dataclass(frozen=True)
class Carried:
    """What the file makes of a cause."""

    effect: str
    where: str
    is_carried: bool
    sentence: str


@dataclass(frozen=True)
class ModelFile:
    """The file, not yet written."""

    name: str
    text: str
    carried: tuple[Carried, ...]


@dataclass(frozen=True)
class _Entry:
    """A cause that is about to be let into an arm."""

    cause: Cause
    effect: Effect
    values: Float64
    details: NDArray[np.bool_]
    """bool[Q], which numbers say how and may be left out."""
    structure: Structure

    @property
    def plain(self) -> "_Entry":
        """Return it without details."""
        return dataclasses.replace(self, values=np.where(self.details, 0.0, self.values))


def model_file(dataset: Dataset, verdict: Verdict) -> ModelFile:
    """Return the model with its base fitted and every cause in it that the file can hold.

    Raises:
        IdentificationError: the verdict is not of this arm, or a fitted value cannot be written.
    """
    if dataset.source.kind == "mjcf" and verdict.timestep is not None:
        dataset = without_limits(with_timestep(dataset, verdict.timestep), verdict.unlimited)
    subject = subject_of(dataset, capacity=1)
    entries = [_entry(subject, cause) for cause in verdict.causes]
    if dataset.source.kind == "pr2":
        return _pr2_file(dataset, subject, verdict, entries)
    return _mjcf_file(dataset, subject, verdict, entries)


def _pr2_file(
    dataset: Dataset, subject: Subject, verdict: Verdict, entries: Sequence[_Entry]
) -> ModelFile:
    nominal = load_parameters(dataset.source.parameters or "nominal")
    native: list[_Entry] = []
    delay = nominal.command.delay
    measured = list(nominal.measurement)
    carried: list[Carried] = []
    for entry in entries:
        touched, changed = _touched(dataset, subject, entry)
        if not entry.structure and changed <= {"fields"} and touched <= FIELDS:
            native.append(entry)
            carried.append(_said(entry, True, f"as {_words(touched)} of the arm"))
        elif not entry.structure and changed <= {"fields", "forces"} and touched <= FIELDS:
            native.append(entry)
            said = f"its inertia as {_words(touched)} of the arm; its weight the file cannot hold"
            carried.append(_said(entry, False, said))
        elif entry.effect.name == "command_latency":
            delay += float(entry.values[0])
            carried.append(_said(entry, True, "as command.delay"))
        elif entry.effect.side in ("joints", "tracker"):
            values = {q.name: float(v) for q, v in _named(subject, entry)}
            measured.append(
                Measured(effect=entry.effect.name, where=entry.cause.where, values=values)
            )
            said = (
                "under [[measurement]]: it changes what is logged and not how the arm moves, so "
                "train and play do without it"
            )
            carried.append(_said(entry, True, said))
        else:
            carried.append(_said(entry, False, _how_to_apply(entry, "model.toml")))
    row = _whole(dataset, subject, verdict, native)
    try:
        parameters = pr2_parameters(nominal, subject.nominal.model, row.fields)
        command = msgspec.structs.replace(parameters.command, delay=delay)
        parameters = msgspec.structs.replace(
            parameters,
            name=f"identified from {dataset.folder.resolve().name}",
            command=msgspec.convert(msgspec.to_builtins(command), type(command)),
            measurement=tuple(measured),
        )
    except (ValueError, msgspec.ValidationError) as error:
        raise IdentificationError(f"the fitted model cannot be written as TOML: {error}") from error
    return ModelFile("model.toml", dump_parameters(parameters), tuple(carried))


def _mjcf_file(
    dataset: Dataset, subject: Subject, verdict: Verdict, entries: Sequence[_Entry]
) -> ModelFile:
    carried: list[Carried] = []
    native: list[_Entry] = []
    for entry in entries:
        touched, changed = _touched(dataset, subject, entry)
        if changed <= _NATIVE:
            native.append(entry)
            said = f"as {_words(touched)}" if touched else "in its structure"
            if entry.structure:
                said += "; a joint was added for it"
            carried.append(_said(entry, True, said))
            continue
        touched, changed = _touched(dataset, subject, entry.plain)
        if touched and changed <= _NATIVE:
            native.append(entry.plain)
            left = listing([q.name for q, value in _named(subject, entry) if q.is_detail and value])
            said = f"as {_words(touched)}; its {left} the file cannot hold"
            carried.append(_said(entry, True, said))
        else:
            carried.append(_said(entry, False, _how_to_apply(entry, "model.xml")))
    row = _whole(dataset, subject, verdict, native)
    if np.any(row.current("dof_frictionloss") > 0.0):
        for field in ("dof_solimp", "dof_solref"):  # what friction holds is to stick, or creep,
            row.field(field)  # and to turn round as it does in the fit
    path = dataset.source.path
    assert path is not None  # a plant was made of it
    text = patched_xml(subject.plant, path, _structure(native), row.fields)
    return ModelFile("model.xml", text, tuple(carried))


def _entry(subject: Subject, cause: Cause) -> _Entry:
    effect = next((each for each in effects() if each.name == cause.effect), None)
    if effect is None:
        raise IdentificationError(f"the verdict names {cause.effect!r}, which no effect is called")
    known = {**cause.others, cause.quantity: cause.value}
    quantities = effect.quantities(subject, cause.where)
    details = np.array([quantity.is_detail for quantity in quantities], np.bool_)
    lost = [each.name for each in quantities if each.name not in known and not each.is_detail]
    if lost:
        raise IdentificationError(f"the verdict's {cause.effect} lacks {', '.join(lost)}")
    values = np.array([known.get(quantity.name, 0.0) for quantity in quantities], np.float64)
    return _Entry(cause, effect, values, details, effect.structure(subject, cause.where))


def _whole(dataset: Dataset, subject: Subject, verdict: Verdict, native: Sequence[_Entry]) -> Row:
    """Return an arm with the fitted base and causes in it."""

    def enter(row: Row) -> None:
        _enter_base(row, subject, verdict)
        for entry in native:
            entry.effect.enter(row, entry.cause.where, entry.values)

    return _entered(dataset, _rollouts(subject, _structure(native)), enter)


def _structure(entries: Sequence[_Entry]) -> Structure:
    return tuple(dict.fromkeys(edit for entry in entries for edit in entry.structure))


def _entered(dataset: Dataset, rollouts: Rollouts, entry: Callable[[Row], None]) -> Row:
    return rollouts.entered(entry, recorded_of(dataset)[0])


def _enter_base(row: Row, subject: Subject, verdict: Verdict) -> None:
    parameters = (*base_parameters(subject), *if_shown(subject))
    known = {parameter.name: parameter for parameter in parameters}
    for value in verdict.base:
        if value.name not in known:
            raise IdentificationError(f"the verdict fits {value.name!r}, which this arm has not")
        # Of a tie nothing is written, so neither is the base that was fitted together with it.
        known[value.name].change(row, value.extended if verdict.causes else value.base_fit)


def _touched(dataset: Dataset, subject: Subject, entry: _Entry) -> tuple[set[str], set[str]]:
    """Return the fields of the model, and the attributes of a row, that a cause changes."""
    changed: set[str] = set()

    def enter(row: Row) -> None:
        names = [field.name for field in dataclasses.fields(row)]
        before = [_mark(getattr(row, name)) for name in names]
        entry.effect.enter(row, entry.cause.where, entry.values)
        for name, mark in zip(names, before, strict=True):
            now = _mark(getattr(row, name))
            if now is not mark and not (isinstance(mark, int) and now == mark):
                changed.add(name)

    row = _entered(dataset, _rollouts(subject, entry.structure), enter)
    return set(row.fields), changed


def _rollouts(subject: Subject, structure: Structure) -> Rollouts:
    return Rollouts(subject.plant, structure, 1) if structure else subject.nominal


def _mark(value: object) -> object:
    """Return what tells whether an effect has changed an attribute of a row, or added to it."""
    return len(cast("Sized", value)) if isinstance(value, list | dict) else value


def _named(subject: Subject, entry: _Entry) -> list[tuple[Quantity, float]]:
    quantities = entry.effect.quantities(subject, entry.cause.where)
    return list(zip(quantities, entry.values.tolist(), strict=True))


def _said(entry: _Entry, is_carried: bool, sentence: str) -> Carried:
    return Carried(entry.cause.effect, entry.cause.where, is_carried, sentence)


def _words(touched: set[str]) -> str:
    words = sorted({_FIELD_WORDS[name] for name in touched if name in _FIELD_WORDS})
    return " and ".join(words) or "other values"


def _how_to_apply(entry: _Entry, file: str) -> str:
    """Return how to apply a cause that a file cannot hold."""
    module = f"shared/identification/catalogue/{entry.effect.name}.py"
    match entry.effect.side:
        case "command":
            how = "apply it to the commands before they reach the controller"
        case "joints" | "tracker":
            how = "it changes what is logged: apply it to what is simulated before comparing"
        case "plant" if entry.structure:
            how = "it needs another joint or element in the model"
        case _:
            how = "add its torque at every step"
    return f"{file} cannot hold it: {how}, as {module} does"
