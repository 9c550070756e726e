"""A verdict in words: numbers with units, and the lines that `riposte identify` ends with."""

import math
import textwrap
from pathlib import Path

from shared.identification.conclusion.sentence import as_told
from shared.identification.verdict import (
    Cause,
    HeldOut,
    Interval,
    Limit,
    Tie,
    Unexplained,
    Verdict,
)
from shared.telemetry.wording import listing, scaled

WIDTH = 88
LISTED = 3
"""Of what stays unexplained, on the screen."""
WARNINGS = 2
"""Of what a verdict is worth less for, on the screen."""
TITLES = {
    "named": "A cause was found",
    "none": "Nothing to name",
    "tie": "One of several causes",
    "base_too_coarse": "The base model is too coarse",
    "unexplained": "Something is left that has no name",
}
"""Of each verdict."""
MINUS = "\N{MINUS SIGN}"


def title_text(verdict: Verdict) -> str:
    """Return what came out, in a few words."""
    count = len(verdict.causes)
    found = f"{count} causes were found" if count > 1 else TITLES["named"]
    if verdict.verdict == "tie" and count:
        return f"{found}, and one of several beside"
    return found if count else TITLES[verdict.verdict]


def number_text(value: float, digits: int = 3) -> str:
    """Return a number with some significant digits and a proper minus, without powers of ten."""
    if value != value:
        return "not known"
    if abs(value) == float("inf"):
        return f"{MINUS if value < 0.0 else ''}\N{INFINITY}"
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-6 < abs(value) < 1e7:
        decimals = max(0, digits - 1 - int(text.partition("e")[2]))
        text = f"{value:,.{decimals}f}"
    return text.replace("-", MINUS)


def moment_text(seconds: float) -> str:
    """Return a moment of a recording, to a hundredth of a second."""
    return f"{round(seconds, 2) + 0.0:.6g}".replace("-", MINUS)


def quantity_text(value: float, unit: str, interval: Interval | None = None) -> str:
    """Return a quantity and its 95 % interval: ``30 ms (29.8 to 30.2)``."""
    ends = () if interval is None else (interval.low, interval.high)
    shown, factor = scaled(unit, value, *ends)
    text = f"{number_text(factor * value)} {shown}".strip()
    if interval is None:
        return text
    low, high = (number_text(factor * end) for end in ends)
    return f"{text} ({low} to {high})"


def where_text(where: str) -> str:
    """Return a place for people; names of joints are as they are in the data."""
    return where or "the whole arm"


def cause_text(cause: Cause) -> str:
    """Return a cause in a line: what, where, how large, how sure."""
    where = f" at {cause.where}" if cause.where else ""
    return f"{cause.title}{where}: {size_text(cause)}"


def size_text(cause: Cause) -> str:
    """Return what says how large a cause is, with its 95 % interval: ``delay 30 ms (29 to 31)``."""
    told = as_told(cause)
    return f"{told.quantity} {quantity_text(told.value, told.unit, told.interval)}"


def limit_text(limit: Limit) -> str:
    """Return from which size on an effect would have been named, as its size is told."""
    if limit.size is None:
        return "at no size"
    name = limit.quantity.removeprefix("inverse_")
    which = "from" if name == limit.quantity else "up to"
    name = "amplitude" if name == "cosine" else name.replace("_", " ")
    return f"{name} {which} {sizes_text(limit.quantity, limit.unit, limit.size)}"


def sizes_text(quantity: str, unit: str, *sizes: float) -> str:
    """Return sizes as they are told, with one unit that fits them all: ``3 to 40 mrad``."""
    if quantity.startswith("inverse_"):
        unit = unit.removeprefix("1/").strip("()")
        sizes = tuple(1.0 / each for each in sizes)
    shown, factor = scaled(unit, *(each for each in sizes if math.isfinite(each)))
    texts = [number_text(factor * each, 2) for each in sizes]
    return f"{' to '.join(texts)} {shown}".strip()


def share_text(share: float, interval: Interval | None = None) -> str:
    """Return a share in percent, with its interval."""
    text = f"{100.0 * share:.0f} %".replace("-", MINUS)
    if interval is None:
        return text
    low, high = (f"{100.0 * end:.0f}".replace("-", MINUS) for end in (interval.low, interval.high))
    return f"{text} ({low} to {high})"


def held_out_text(held_out: HeldOut) -> str:
    """Return how far off each stage is on motion that nothing was fitted to."""
    text = (
        f"{number_text(held_out.nominal)} nominal, {number_text(held_out.base_fit)} with base "
        f"parameters fitted, {number_text(held_out.extended)} extended; {floor_text(held_out)}"
    )
    if held_out.tracker_mm:
        ends = [held_out.tracker_mm.get(stage) for stage in ("base_fit", "extended")]
        if ends[0] is not None and ends[1] is not None:
            text += f" (tracker {number_text(ends[0])} to {number_text(ends[1])} mm)"
    return text


def floor_name(held_out: HeldOut) -> str:
    """Return what residuals are told in units of."""
    return "the noise floor" if held_out.is_floor_measured else "what the base fit usually leaves"


def floor_text(held_out: HeldOut) -> str:
    """Return what 1 is."""
    if held_out.is_floor_measured:
        return "1 is the noise floor"
    return (
        "1 is what the base fit usually leaves where it was fitted, for no recording repeats "
        "another and the noise is not known"
    )


def tie_texts(tie: Tie) -> list[str]:
    """Return a tie, a line each: what it would be, and how large, then how alike they are."""
    first, *others = map(cause_text, tie.causes)
    return [first, *(f"or {other}" for other in others), f"alike to {number_text(tie.alike)} of 1"]


def unexplained_text(left: Unexplained, held_out: HeldOut) -> str:
    """Return in a line where something is left, and how much."""
    size = quantity_text(left.size, left.unit)
    return (
        f"{left.where}, {left.trajectory} from {moment_text(left.begin)} to "
        f"{moment_text(left.end)} s, {when_text(left)}: {size}, "
        f"{number_text(left.times_noise)} times {floor_name(held_out)}"
    )


def _unexplained_texts(verdict: Verdict) -> list[str]:
    """Return the largest of what is left, and how many there are beside."""
    found = verdict.unexplained
    return _listed([unexplained_text(each, verdict.held_out) for each in found], LISTED)


def _warnings(verdict: Verdict) -> list[str]:
    """Return what makes a verdict worth less, and how much there is beside."""
    agree = "base fits from different starts did not meet: believe little of this"
    return _listed([*([] if verdict.starts_agree else [agree]), *verdict.caveats], WARNINGS)


def _listed(texts: list[str], most: int) -> list[str]:
    """Return the first of some texts, and how many there are beside."""
    more = len(texts) - most
    return [*texts[:most], f"and {more} more, in the report"] if more > 0 else texts


def _limit_texts(verdict: Verdict) -> list[str]:
    """Return in a line what of the whole arm would have been named, where nothing was."""
    if verdict.verdict != "none":
        return []
    shown = [
        f"{each.effect.replace('_', ' ')} ({limit_text(each)})"
        for each in verdict.limits
        if not each.where and each.size is not None
    ]
    return [f"{listing(shown)}; of each joint in the report"] if shown else []


def when_text(left: Unexplained) -> str:
    """Return when something is left, and whether it came from outside."""
    return f"external, {left.phase}" if left.is_external else left.phase


def unexplained_mark(number: int) -> str:
    """Return the letter of the nth place where something is left: A, B, ... Z, 27, 28."""
    return chr(ord("A") + number) if number < 26 else str(number + 1)


def verdict_text(verdict: Verdict, folder: Path) -> str:
    """Return a verdict on one screen."""
    lines = ["", *textwrap.wrap(verdict.sentence, WIDTH), ""]

    def add(name: str, texts: list[str]) -> None:
        for index, text in enumerate(texts):
            first = f"{name if index == 0 else '':<12}"
            lines.extend(
                textwrap.wrap(text, WIDTH, initial_indent=first, subsequent_indent=" " * 12)
            )

    add("cause", [cause_text(cause) for cause in verdict.causes])
    add("either", [text for tie in verdict.ties for text in tie_texts(tie)])
    add("held out", [held_out_text(verdict.held_out)])
    if verdict.causes:
        share = share_text(verdict.held_out.share_removed, verdict.held_out.share_interval)
        add("", [f"removes {share} of what could be explained"])
    add("unexplained", _unexplained_texts(verdict))
    add("would show", _limit_texts(verdict))
    add("record next", list(verdict.record_next[:3]))
    add("beware", _warnings(verdict))
    add("report", [str(folder / "report.html")])
    return "\n".join(lines)
