"""Says in a sentence or two what a search comes to."""

from shared.identification.searched import NEARLY_NOISE
from shared.identification.verdict import Cause, HeldOut, Tie, Unexplained, Word
from shared.telemetry.wording import listing


def sentence_of(
    word: Word,
    causes: tuple[Cause, ...],
    ties: tuple[Tie, ...],
    held_out: HeldOut,
    left: tuple[Unexplained, ...],
) -> str:
    """Return the verdict for people."""
    floor = "the noise" if held_out.is_floor_measured else "what the base fit usually leaves"
    ratio = f"{held_out.base_fit:.2f} times {floor}"
    if word == "named":
        return (
            f"What the simulation gets wrong: {_named(causes)}. Held out, the residual goes from "
            f"{ratio} to {held_out.extended:.2f}.{_also_pushed(left)}"
        )
    if word == "tie":
        either = " or ".join(label(cause) for cause in ties[0].causes)
        told = f"These recordings do not tell apart: {either}. {ties[0].record}"
        if not causes:
            return told
        return f"What the simulation surely gets wrong: {_named(causes)}. Beside it: {told}"
    if word == "none":
        return f"Nothing to name: with its base fitted the simulation is at {ratio}."
    if word == "base_too_coarse":
        return (
            f"The base model does not fit: {ratio} are left with links far from their known mass. "
            "Release more of its parameters, or correct the model file, before looking for causes."
        )
    if causes:
        names = " and ".join(f"{label(cause)} ({_size(cause)})" for cause in causes)
        return (
            f"Something is wrong that no effect of the catalogue explains. Nearest comes {names}, "
            f"but from {ratio} it leaves {held_out.extended:.2f}, which is too much to believe it."
        )
    if left and all(each.is_external for each in left):
        return f"Nothing to name but what came from outside.{_also_pushed(left)}"
    if left and held_out.base_fit**2 <= NEARLY_NOISE:
        first = left[0]
        return (
            f"With its base fitted the simulation is at {ratio}, but something stands out that no "
            f"effect of the catalogue explains: at {first.where}, from {first.begin:.2f} to "
            f"{first.end:.2f} s of {first.trajectory}, {first.times_noise:.2g} times the noise."
        )
    place = f", most of it at {left[0].where} {left[0].phase}" if left else ""
    return f"Something is wrong that no effect of the catalogue explains: {ratio}{place}."


def _also_pushed(left: tuple[Unexplained, ...]) -> str:
    """Return what came from outside, the largest first; a sentence after a blank, or nothing."""
    pushes = [each for each in left if each.is_external]
    if not pushes:
        return ""
    first = pushes[0]
    count = "once," if len(pushes) == 1 else f"{len(pushes)} times, most"
    size = "" if first.torque is None else f" with {first.torque:.2g} {first.torque_unit}"
    return (
        f" Something outside pushed {first.where} {count} from "
        f"{first.begin:.2f} to {first.end:.2f} s of {first.trajectory}{size}."
    )


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


def _size(cause: Cause) -> str:
    half = (cause.interval.high - cause.interval.low) / 2
    unit = "" if cause.unit == "1" else f" {cause.unit}"
    return f"{cause.quantity} {cause.value:.3g} ± {half:.1g}{unit}"
