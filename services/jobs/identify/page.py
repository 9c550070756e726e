"""The HTML report of `riposte identify`, from verdict and evidence alone."""

from dataclasses import dataclass

from services.jobs.identify import considered, pictures, words
from services.jobs.identify.residuals import stages_of
from shared.identification.conclusion.evidence import Evidence
from shared.identification.conclusion.model_file import Carried
from shared.identification.conclusion.sentence import as_told
from shared.identification.verdict import Cause, Verdict
from shared.telemetry import html
from shared.telemetry.html import Html, Node, tag

BENT = (
    "A base fit that has to stand in for a missing cause bends its parameters: they look "
    "identified and are wrong. Where a cause was named, those of the extended model are the ones "
    "to believe; where none was, the two are the same."
)

WHOLE = (
    "Which causes there are was judged on motion that nothing was fitted to, and what is told of "
    "held-out motion is of that fit. How large they are is told from a last fit to all recordings "
    "but held-out ones in which something pushed the arm."
)


@dataclass(frozen=True)
class About:
    """What the page says of how it was made."""

    name: str
    """Of the data set."""
    command: str
    """That makes the page again."""
    model_file: str
    """Name of the extended model's file."""
    carried: tuple[Carried, ...]
    """What that file says of each cause."""


def report_page(verdict: Verdict, evidence: Evidence, about: About) -> str:
    """Return the whole page."""
    return html.page(
        f"Riposte: what the simulation of {about.name} gets wrong",
        _head(verdict, evidence, about),
        _wrong(verdict, evidence),
        _causes(verdict, evidence),
        considered.ties(verdict),
        considered.record_next(verdict),
        _held_out(verdict, evidence),
        considered.candidates(verdict),
        considered.limits(verdict),
        considered.unexplained(verdict, evidence),
        _diagnostics(evidence),
        _base(verdict),
        _model(about),
        considered.caveats(verdict),
        considered.again(verdict, about.command),
    )


def _head(verdict: Verdict, evidence: Evidence, about: About) -> Node:
    train = sum(replay.split == "train" for replay in evidence.replays)
    counted = f"{train} recordings to fit, {len(evidence.replays) - train} held out"
    window = pictures.shown_window(verdict, evidence)
    return [
        tag("p", f"riposte identify · {about.name} · {counted}", class_="soft"),
        tag("h1", words.title_text(verdict)),
        tag("p", verdict.sentence, class_="lead"),
        None
        if verdict.starts_agree
        else tag(
            "p",
            tag("b", "Beware: ", class_="bad"),
            "base fits from different starts did not meet, so believe little of this page.",
        ),
        html.tiles(_tiles(verdict)),
        considered.panels(
            [pictures.stages(verdict), pictures.left_over(window, verdict, evidence)]
        ),
    ]


def _tiles(verdict: Verdict) -> list[tuple[Node, Node, str]]:
    held_out = verdict.held_out
    tiles: list[tuple[Node, Node, str]] = [
        (
            words.quantity_text(cause.value, cause.unit),
            f"{cause.quantity}: {cause.effect.replace('_', ' ')}, {words.where_text(cause.where)}",
            "good",
        )
        for cause in map(as_told, verdict.causes[:2])
    ]
    if verdict.causes:
        tiles.append((
            words.share_text(held_out.share_removed),
            "of the explainable residual on held-out motion is removed",
            "good",
        ))  # fmt: skip
    last = getattr(held_out, stages_of(verdict)[-1])
    tiles.append((
        f"{words.number_text(held_out.nominal)} \N{RIGHTWARDS ARROW} {words.number_text(last)}",
        "times the noise floor, nominal model to the best"
        if held_out.is_floor_measured
        else f"nominal model to the best; {words.floor_text(held_out)}",
        "",
    ))  # fmt: skip
    if verdict.ties:
        count = max(len(tie.causes) for tie in verdict.ties)
        tiles.append((f"1 of {count}", "causes that these data do not tell apart", "bad"))
    if verdict.unexplained:
        largest = max(left.times_noise for left in verdict.unexplained)
        about = f"{words.floor_name(held_out)} is what the largest unexplained part reaches"
        tiles.append((f"{words.number_text(largest, 2)}x", about, "bad"))
    tiles.append((str(len(verdict.candidates)), "candidate causes were looked at", ""))
    return tiles


def _wrong(verdict: Verdict, evidence: Evidence) -> Html:
    window = pictures.shown_window(verdict, evidence)
    found = [pictures.motion(window, verdict, evidence), pictures.by_joint(verdict, evidence)]
    if (tracker := pictures.tracker(window, verdict, evidence)) is not None:
        found.append(tracker)
    return html.section("What the simulation gets wrong", considered.panels(found))


def _causes(verdict: Verdict, evidence: Evidence) -> Html | None:
    if not verdict.causes:
        return None
    shown = pictures.before_and_after(verdict, evidence)
    cards = [
        tag("div", _cause(cause), considered.panels([picture]), class_="beside")
        for cause, picture in zip(verdict.causes, shown, strict=True)
    ]
    title = "The cause" if len(verdict.causes) == 1 else "The causes, largest first"
    return html.section(title, cards, tag("p", WHOLE))


def _cause(cause: Cause) -> Html:
    told = as_told(cause)
    rows: list[tuple[Node, Node]] = [
        ("effect", tag("code", cause.effect)),
        ("where", words.where_text(cause.where)),
        (
            f"{told.quantity} (95 %)",
            tag("b", words.quantity_text(told.value, told.unit, told.interval)),
        ),
        *(
            (
                name,
                words.quantity_text(
                    value, told.other_units.get(name, ""), told.other_intervals.get(name)
                ),
            )
            for name, value in told.others.items()
        ),
        ("left more without it", words.share_text(cause.share, cause.share_interval)),
    ]
    where = f" at {cause.where}" if cause.where else ""
    title = cause.title[:1].upper() + cause.title[1:]
    return tag(
        "div",
        tag("h3", f"{title}{where}"),
        tag("p", f"How it shows: {cause.signature}"),
        html.table(("", ""), rows),
    )


_PARTS = (
    " Told torques and no positions, a simulated arm runs away from where the real one goes, so it "
    "is set there anew again and again. The angles are how far off it is until the next time; "
    "x noise counts what is new from block to block, in which an error counts once. So the two "
    "need not agree, and pictures of angles are darker than the verdict."
)


def _held_out(verdict: Verdict, evidence: Evidence) -> Html:
    held_out = verdict.held_out
    stages = (("nominal", "nominal"), ("base_fit", "base fit"), ("extended", "extended"))
    rows: list[tuple[Node, ...]] = [
        (
            name,
            words.number_text(getattr(held_out, stage)),
            _of(held_out.joints_mrad, stage),
            *((_of(held_out.tracker_mm, stage),) if held_out.tracker_mm else ()),
        )
        for stage, name in stages
    ]
    floor = _of(held_out.joints_mrad, "noise_floor")
    rows.append((
        "noise floor" if held_out.is_floor_measured else "noise floor, not measured",
        "1" if held_out.is_floor_measured else words.number_text(held_out.noise_floor),
        floor,
        *((_of(held_out.tracker_mm, "noise_floor"),) if held_out.tracker_mm else ()),
    ))  # fmt: skip
    headers = ["stage", "x noise", f"joints, {pictures.small_unit(evidence)}"]
    headers += ["tracker, mm"] if held_out.tracker_mm else []
    share = words.share_text(held_out.share_removed, held_out.share_interval)
    caption = (
        "Root-mean-square residual on trajectories that nothing was fitted to. The extension "
        f"removes {share} (95 %) of what lies between base fit and "
        f"{words.number_text(held_out.noise_floor)}, which a right model leaves at most."
    )
    if not verdict.causes:
        caption = "Root-mean-square residual on trajectories that nothing was fitted to."
    if not held_out.is_floor_measured:
        caption += f" {words.floor_text(held_out)}."
    if evidence.is_in_parts:
        caption += _PARTS
    each = [
        (
            replay.name,
            replay.split,
            *(_of({str(stage): loss for stage, loss in replay.loss.items()}, stage)
              for stage, _ in stages),
        )
        for replay in evidence.replays
    ]  # fmt: skip
    return html.section(
        "Before and after on held-out motion",
        html.table(headers, rows, numbers=range(1, len(headers)), caption=caption),
        html.details(
            "Every trajectory",
            html.table(
                ("trajectory", "split", *(name for _, name in stages)), each, numbers=(2, 3, 4),
                caption=f"Residual in units of {words.floor_name(held_out)}.",
            ),
        ),
    )  # fmt: skip


def _of(values: dict[str, float], key: str) -> str:
    return words.number_text(values[key]) if key in values else "-"


def _diagnostics(evidence: Evidence) -> Html:
    about = (
        "How the residual of the base fit looks, before any cause was looked for; measured minus "
        "predicted, over all recordings. Nothing was decided here: it is for people who know the "
        "arm."
    )
    return html.section(
        "Diagnostics", tag("p", about), considered.panels(pictures.diagnostics(evidence))
    )  # fmt: skip


def _base(verdict: Verdict) -> Html | None:
    if not verdict.base:
        return None
    picture = pictures.base(verdict)
    rows = [
        (
            row.name,
            row.unit,
            *(words.number_text(value) for value in (row.nominal, row.base_fit, row.extended)),
            f"{words.number_text(row.interval.low)} to {words.number_text(row.interval.high)}",
        )
        for row in verdict.base
    ]
    headers = ("parameter", "unit", "nominal", "base fit", "extended", "95 % of extended")
    return html.section(
        "Base parameters",
        tag("div", considered.panels([picture]), tag("p", BENT), class_="beside")
        if picture is not None
        else None,
        html.details(
            f"All {len(rows)} parameters", html.table(headers, rows, numbers=(2, 3, 4, 5))
        ),
    )


def _model(about: About) -> Html:
    rows = [
        (
            f"{one.effect} {one.where}".strip(),
            tag("span", "in the file" if one.is_carried else "not in it",
                class_="good" if one.is_carried else "bad"),
            one.sentence,
        )
        for one in about.carried
    ]  # fmt: skip
    return html.section(
        "The extended model",
        tag("p", tag("code", about.model_file), " beside this page has the base parameters as "
            "they were fitted", ", and of each cause:" if rows else "; there is no cause to add."),
        html.table(("cause", "", "how"), rows) if rows else None,
    )  # fmt: skip
