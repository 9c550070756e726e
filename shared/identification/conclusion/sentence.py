"""Says in a sentence or two what a search comes to."""

import math
from collections.abc import Sequence

import msgspec

from shared.identification.leftover.phases import AGAIN
from shared.identification.search.searched import NEARLY_NOISE
from shared.identification.verdict import (
    BaseValue,
    Cause,
    HeldOut,
    Interval,
    Tie,
    Unexplained,
    Word,
)
from shared.telemetry.wording import listing, scaled

_WAY = frozenset("xyz")
"""Numbers that are a way in space."""
_MENDED = 1.2
"""Times what the base fit leaves, that a file has to leave to be said to be other than the arm."""
_TOLD = 3
"""Numbers of the base that are told of."""


def sentence_of(
    word: Word,
    causes: tuple[Cause, ...],
    ties: tuple[Tie, ...],
    held_out: HeldOut,
    left: tuple[Unexplained, ...],
    not_believed: str = "",
    doubted: tuple[str, ...] = (),
) -> str:
    """Return the verdict for people.

    Args:
        word: the verdict.
        causes: that are told of.
        ties: what is not told apart.
        held_out: how much is left.
        left: where.
        not_believed: why the causes are told of and not named: ``which is too much``.
        doubted: numbers of links that are held, since the base went further than is believable.
    """
    floor = "the noise" if held_out.is_floor_measured else "what the base fit usually leaves"
    ratio = f"{held_out.base_fit:.2f} times {floor}"
    if word == "named":
        return (
            f"What the simulation gets wrong: {_named(causes)}. Held out, the residual goes from "
            f"{ratio} to {held_out.extended:.2f}{_by_all(held_out)}.{_also_pushed(left)}"
        )
    if word == "tie":
        either = " or ".join(label(cause) for cause in ties[0].causes)
        told = f"These recordings do not tell apart: {either}. {ties[0].record}"
        if not causes:
            return told
        return f"What the simulation surely gets wrong: {_named(causes)}. Beside it: {told}"
    if word == "none":
        told = f"{ratio}{_by_all(held_out)}"
        return (
            f"Nothing to name: with its base fitted the simulation is at {told}."
            f"{_also_pushed(left)}"
        )
    if word == "base_too_coarse":
        return (
            f"The base model does not fit: {ratio} are left with {listing(doubted)} as the model "
            "file has it, and a fit that may change it goes further than is believable (30 %, "
            "15 mm). Check what the model file says of the links; where it is right, something "
            "acts that no effect of the catalogue explains by itself."
        )
    if causes:
        names = " and ".join(f"{label(cause)} ({_size(cause)})" for cause in causes)
        return (
            f"Something is wrong that no effect of the catalogue explains. Nearest comes {names}, "
            f"but from {ratio} it leaves {held_out.extended:.2f}, {not_believed}."
        )
    if left and all(each.is_external for each in left):
        if held_out.base_fit**2 <= NEARLY_NOISE:
            return f"Nothing to name but what came from outside.{_also_pushed(left)}"
        told = f"Something is wrong that no effect of the catalogue explains: {ratio}."
        return f"{told}{_also_pushed(left)}"
    if left and held_out.base_fit**2 <= NEARLY_NOISE:
        first = left[0]
        return (
            f"With its base fitted the simulation is at {ratio}, but something stands out that no "
            f"effect of the catalogue explains: at {first.where}, from {first.begin:.2f} to "
            f"{first.end:.2f} s of {first.trajectory}, {first.times_noise:.3g} times the noise."
        )
    place = f", most of it at {left[0].where} {left[0].phase}" if left else ""
    return f"Something is wrong that no effect of the catalogue explains: {ratio}{place}."


def with_far(sentence: str, word: Word, far: str) -> str:
    """Return a verdict for people with what the base is far from, where nothing is named.

    That is what is wrong then, as far as is known.

    Args:
        sentence: the verdict.
        word: the same, in one.
        far: which numbers of the model file the base fit is surely far from, or nothing.
    """
    if not far or word not in ("none", "unexplained"):
        return sentence
    return f"{sentence} {far[0].upper()}{far[1:]}."


def with_base(sentence: str, word: Word, base: Sequence[BaseValue], held_out: HeldOut) -> str:
    """Return a verdict for people with what its base fit mended, where there is nothing to name.

    Args:
        sentence: the verdict.
        word: the same, in one.
        base: its numbers; told are those that are surely not the file's, surest first.
        held_out: how much the file and the base fit leave.
    """
    if word != "none" or held_out.nominal < _MENDED * held_out.base_fit:
        return sentence
    sure = [each for each in base if _is_other(each)]
    sure.sort(key=_errors_off, reverse=True)
    if not sure:
        return sentence
    told = listing([_changed(each) for each in sure[:_TOLD]])
    more = f" and {len(sure) - _TOLD} more" if len(sure) > _TOLD else ""
    return (
        f"{sentence} The file's own numbers are at {held_out.nominal:.2f}; the fit has other ones, "
        f"surest {told}{more}."
    )


def _is_other(each: BaseValue) -> bool:
    return bool(each.nominal) and not each.interval.low <= each.nominal <= each.interval.high


def _errors_off(each: BaseValue) -> float:
    half = 0.5 * (each.interval.high - each.interval.low)
    return abs(each.extended - each.nominal) / max(half, 1e-300)


def _changed(each: BaseValue) -> str:
    unit = f" {each.unit}" if each.unit else ""
    return f"{each.name} {each.extended:.3g}{unit} for {each.nominal:.3g}"


def _by_all(held_out: HeldOut) -> str:
    """Return what is left with held-out motion in the fit, where the verdict goes by that."""
    left = held_out.by_all
    return "" if left is None else f", {left:.2f} once it is fitted to these, too"


def _also_pushed(left: tuple[Unexplained, ...]) -> str:
    """Return what came from outside, or looks like it: sentences, each after a blank, or none."""
    told = ""
    if pushes := [each for each in left if each.is_external]:
        first, joints = pushes[0], list(dict.fromkeys(each.where for each in pushes))
        count = "once," if len(pushes) == 1 else f"{len(pushes)} times, most"
        where = f" at {first.where}" if len(joints) > 1 else ""
        told = f" Something outside pushed {listing(joints)} {count} {_most(first)}{where}."
    for where in dict.fromkeys(each.where for each in left if each.phase == AGAIN):
        own = [each for each in left if each.where == where and each.phase == AGAIN]
        told += (
            f" At {where} a torque is missing again and again ({len(own)} times, most "
            f"{_most(own[0])}): too often to be pushes, so a law that the catalogue lacks."
        )
    return told


def _most(push: Unexplained) -> str:
    """Return when a push was and how hard it pushed."""
    size = "" if push.torque is None else f" with {push.torque:.3g} {push.torque_unit}"
    return f"from {push.begin:.2f} to {push.end:.2f} s of {push.trajectory}{size}"


def label(cause: Cause) -> str:
    """Return what and where a cause is, in plain words."""
    words = cause.effect.replace("_", " ")
    return f"{words} of {cause.where}" if cause.where else words


def _named(causes: tuple[Cause, ...]) -> str:
    """Return causes in words, with all the joints of one effect together."""
    places: dict[str, list[str]] = {}
    for cause in causes:
        where = f"at {cause.where} " if cause.where else ""
        places.setdefault(cause.title, []).append(f"{where}({_size(cause)})")
    return " and ".join(f"{title} {listing(each)}" for title, each in places.items())


def as_told(cause: Cause) -> Cause:
    """Return a cause with a size for people: of what is sought as one over it, the thing itself.

    ``inverse_limit`` in 1/(N m) is a limit in N m; its upper end is infinite where the inverse may
    be 0, which is no limit. Of a cosine and a sine it is the amplitude, as well known as either; of
    a way that is nothing but a way, its length, as if its parts were known apart. Where the first
    of several numbers may be 0, it is the one that is most surely not.
    """
    if cause.quantity == "cosine":
        amplitude = math.hypot(cause.value, cause.others["sine"])
        half = 0.5 * (cause.interval.high - cause.interval.low)
        ends = Interval(low=max(amplitude - half, 0.0), high=amplitude + half)
        return msgspec.structs.replace(cause, quantity="amplitude", value=amplitude, interval=ends)
    if _WAY <= {cause.quantity, *cause.others} <= _WAY | {"time"}:
        return _as_length(cause)
    name = cause.quantity.removeprefix("inverse_")
    if name == cause.quantity or not cause.value > 0.0:
        return _by_surest(cause)
    low, high = cause.interval.low, cause.interval.high
    return msgspec.structs.replace(
        cause,
        quantity=name,
        value=1.0 / cause.value,
        unit=cause.unit.removeprefix("1/").strip("()"),
        interval=Interval(low=1.0 / high, high=1.0 / low if low > 0.0 else float("inf")),
    )


def _as_length(cause: Cause) -> Cause:
    values = {cause.quantity: cause.value, **cause.others}
    intervals = {cause.quantity: cause.interval, **cause.other_intervals}
    way = {axis: values[axis] for axis in sorted(_WAY)}
    length = math.hypot(*way.values())
    along = (
        value / max(length, 1e-12) * 0.5 * (intervals[axis].high - intervals[axis].low)
        for axis, value in way.items()
        if axis in intervals
    )
    half = math.hypot(*along)
    return msgspec.structs.replace(
        cause, quantity="distance", value=length, others={**way, **cause.others},
        interval=Interval(low=max(length - half, 0.0), high=length + half),
        other_units={**dict.fromkeys(way, cause.unit), **cause.other_units},
        other_intervals=intervals,
    )  # fmt: skip


def _by_surest(cause: Cause) -> Cause:
    """Return a cause with the number first that is most surely not 0, where its first may be."""
    if not _may_be_nothing(cause.interval):
        return cause
    sure = {
        name: abs(cause.others[name]) / max(each.high - each.low, 1e-300)
        for name, each in cause.other_intervals.items()
        if not _may_be_nothing(each)
    }
    if not sure:
        return cause
    name, first = max(sure, key=lambda each: sure[each]), cause.quantity
    values = {first: cause.value, **cause.others}
    units = {first: cause.unit, **cause.other_units}
    intervals = {first: cause.interval, **cause.other_intervals}
    return msgspec.structs.replace(
        cause, quantity=name, value=values.pop(name), unit=units.pop(name),
        interval=intervals.pop(name), others=values, other_units=units, other_intervals=intervals,
    )  # fmt: skip


def _may_be_nothing(interval: Interval) -> bool:
    return interval.low <= 0.0 <= interval.high


def _size(cause: Cause) -> str:
    """Return how large a cause is, and when it was there if it was not always."""
    told = as_told(cause)
    half = (told.interval.high - told.interval.low) / 2
    unit, factor = scaled(told.unit, told.value, *((half,) if math.isfinite(half) else ()))
    unit = f" {unit}" if unit else ""
    value = f"{told.quantity} {factor * told.value:.3g}"
    if not math.isfinite(half):
        return f"{value}{unit}, at least {factor * told.interval.low:.3g}{_when(told)}"
    rounded = float(f"{factor * half:.1g}")
    return f"{value} ± {rounded:g}{unit}{_when(told)}"


def _when(cause: Cause) -> str:
    """Return when something was there that happened once; after a comma, or nothing."""
    begin, length = cause.others.get("begin"), cause.others.get("length")
    if begin is not None and length is not None:
        return f", from {begin:.2f} to {begin + length:.2f} s"
    since = cause.others.get("time")
    return "" if since is None else f", from {since:.2f} s on"
