"""The HTML page of `riposte styles`, from its summary and its figures."""

import dataclasses
from collections.abc import Sequence

from services.jobs.report.words import percent_text, points_text
from services.jobs.styles.summary import (
    GOAL_ACCURACY,
    WARM_START,
    AccuracyNote,
    Analysis,
    FeatureNote,
    MeasureNote,
    PolicyStyle,
    SeparabilityNote,
    StylesSummary,
)
from shared.styles.bundle import Bundle
from shared.styles.components import GOAL, KEPT
from shared.telemetry import html
from shared.telemetry.html import Html, Node, tag
from shared.telemetry.style_figures import Part, StyleOf, component_panels, feature_panels
from shared.telemetry.wording import listing

MOST_TRIPLES = 10
"""Triples shown without being asked."""
PLUS_MINUS = "\N{PLUS-MINUS SIGN}"


@dataclasses.dataclass(frozen=True)
class Drawings:
    """The figures, as SVG."""

    features: str
    components: str


def draw(analysis: Analysis) -> Drawings:
    """Return the figures of an analysis."""
    parts: dict[str, Part] = {
        "selected": "selected", "warm_start": "warm_start", "library": "library",
    }  # fmt: skip
    sample, summary = analysis.sample, analysis.summary
    projected = analysis.components.project(sample.features)
    policies = [
        StyleOf(
            label=policy.label,
            part=parts[policy.part],
            means=policy.mean,
            spreads=policy.spread,
            components=projected[sample.policy == sample.policies.index(policy.label)],
        )
        for policy in summary.policies
        if policy.part in parts
    ]
    shown = [policy for policy in policies if policy.part != "library"]
    return Drawings(
        features=feature_panels([_with_unit(feature) for feature in summary.features], shown),
        components=component_panels(policies, analysis.components.shares[:KEPT].tolist()),
    )


def styles_page(summary: StylesSummary, drawings: Drawings, bundle: Bundle) -> str:
    """Return the whole page."""
    return html.page(
        f"Riposte: styles of {summary.run}",
        _head(summary),
        _styles(summary, drawings),
        _components(summary, drawings),
        _selection(summary),
        _separability(summary),
        _diversity(summary),
        _bundle(summary, bundle),
    )


def _head(summary: StylesSummary) -> Node:
    three = summary.triples[0]
    accuracy = summary.selected_apart.random_folds
    kept = summary.information[KEPT - 1]
    tiles: list[tuple[Node, Node, str]] = [
        (
            f"{kept:.1%}",
            f"of what tells policies apart is kept by three components (paper: {GOAL:.0%})",
            "good" if kept >= GOAL else "bad",
        ),
        (
            f"{accuracy.share:.1%}",
            f"of bouts of the selected three are told apart (goal {GOAL_ACCURACY:.0%})",
            "good" if accuracy.share >= GOAL_ACCURACY else "bad",
        ),
        (f"{three.smallest:.1f}", "standard deviations between the nearest two of them", ""),
        (
            f"{summary.effective_styles.value:.2f}",
            f"effective styles among {len(summary.library)} policies",
            "",
        ),
    ]
    bouts = summary.policies[0].bouts
    return [
        tag("h1", "How the protagonists move, and which three to send"),
        tag("p", f"{summary.run} · seed {summary.seed}", class_="soft"),
        tag(
            "p",
            f"Of {len(summary.library)} protagonists, each seen in {bouts:,} bouts against "
            f"{len(summary.opponents)} antagonists, {listing(three.policies)} are the most "
            "separable. With the warm start they make the bundle at the end of this page.",
            class_="lead",
        ),
        html.tiles(tiles),
    ]


def _styles(summary: StylesSummary, drawings: Drawings) -> Node:
    caption = (
        "The style of the three selected protagonists and the warm start: mean of each feature "
        "over their bouts; the bar is one standard deviation from bout to bout. World frame: x "
        "along the line between the robots, z up."
    )
    others = summary.of_part("other")
    notes = [
        (feature.title, _written(feature.unit), _written(feature.definition))
        for feature in summary.features
    ]
    return html.section(
        "Styles",
        html.figure(html.svg(drawings.features), caption),
        _table(
            summary,
            [policy for policy in summary.policies if policy.part != "other"],
            f"Mean {PLUS_MINUS} standard deviation over {summary.policies[0].bouts:,} bouts; "
            "green: selected. Points are the antagonist's, a bout: fewer is better for the "
            "protagonist.",
        ),
        html.details("Scripted protagonists, for comparison", _table(summary, others, None))
        if others
        else None,
        html.details(
            "What the features are", html.table(("feature", "unit", "definition"), notes)
        ),
    )  # fmt: skip


def _table(summary: StylesSummary, policies: Sequence[PolicyStyle], caption: str | None) -> Html:
    rows: list[tuple[Node, ...]] = [
        (
            _with_unit(feature),
            *(
                f"{_number(policy.mean[k])} {PLUS_MINUS} {_number(policy.spread[k])}"
                for policy in policies
            ),
        )
        for k, feature in enumerate(summary.features)
    ]
    rows.append(("points against", *(points_text(policy.score) for policy in policies)))
    headers = [
        tag("span", policy.label, class_="good" if policy.part == "selected" else None)
        for policy in policies
    ]
    return html.table(("", *headers), rows, numbers=range(1, len(headers) + 1), caption=caption)


def _components(summary: StylesSummary, drawings: Drawings) -> Node:
    caption = (
        "Bouts (dots), styles (circles) and one standard deviation from bout to bout (ellipses) in "
        "the plane of each two components; grey: the rest of the library."
    )
    rows = [
        (str(k + 1), f"{one:.2%}", f"{other:.2%}")
        for k, (one, other) in enumerate(
            zip(summary.information, summary.information_of_bouts, strict=True)
        )
    ]
    weights = [
        (
            f"component {k + 1}",
            *(f"{weight:+.2f}".replace("-", "\N{MINUS SIGN}") for weight in axis),
        )
        for k, axis in enumerate(summary.axes)
    ]
    titles = [feature.title for feature in summary.features]
    verdict = summary.why_not or (
        f"Three components keep {summary.information[KEPT - 1]:.2%} of what tells the "
        f"{len(summary.library)} policies apart; the paper reports less than 2 % lost."
    )
    return html.section(
        "Principal components",
        tag("p", verdict, class_="bad" if summary.why_not else None),
        html.figure(html.svg(drawings.components), caption),
        html.details(
            "How much each number of components keeps",
            html.table(
                ("components", "of the policies' mean styles", "of single bouts"),
                rows,
                numbers=(0, 1, 2),
                caption="Features are standardised over all bouts. The mean styles of n policies "
                "differ in at most n - 1 ways; single bouts also differ by chance.",
            ),
        ),
        html.details(
            "What the components are made of",
            html.table(("", *titles), weights, numbers=range(1, len(titles) + 1)),
        ),
    )


def _selection(summary: StylesSummary) -> Node:
    rows = [
        (str(place), ", ".join(triple.policies), f"{triple.smallest:.2f}", f"{triple.mean:.2f}")
        for place, triple in enumerate(summary.triples, 1)
    ]
    headers = ("", "triple", "smallest distance", "mean distance")
    grid = [
        (
            label,
            *(
                "" if other == label else f"{distance:.2f}"
                for other, distance in zip(summary.library, row, strict=True)
            ),
        )
        for label, row in zip(summary.library, summary.distances, strict=True)
    ]
    left = rows[MOST_TRIPLES:]
    return html.section(
        "Selection",
        tag("p", f"Selected is the triple with the {summary.criterion}."),
        html.table(headers, rows[:MOST_TRIPLES], numbers=(0, 2, 3)),
        html.details(f"{len(left)} more triples", html.table(headers, left, numbers=(0, 2, 3)))
        if left
        else None,
        tag("h3", "Distance of each two"),
        html.table(("", *summary.library), grid, numbers=range(1, len(grid) + 1)),
    )


def _separability(summary: StylesSummary) -> Node:
    groups = (
        ("the selected three", summary.selected_apart),
        (f"all {len(summary.library)}", summary.library_apart),
    )
    rows: list[tuple[Node, ...]] = []
    for title, found in groups:
        unseen = found.by_opponent
        rows.append(
            (
                title,
                f"{found.bouts:,}",
                percent_text(found.chance),
                _share(found.random_folds),
                _share(found.linear),
                "-" if unseen is None else _share(unseen),
            )
        )
    headers = (
        "policies", "bouts", "by chance", "bouts held out at random", "the same, by planes",
        "opponents held out, by planes",
    )  # fmt: skip
    three = summary.selected_apart
    met = three.random_folds.share >= GOAL_ACCURACY
    verdict = (
        f"The goal of {GOAL_ACCURACY:.0%} for three policies is {'met' if met else 'not met'}. "
        "A classifier is fitted to some of the bouts and names the policy of the others, from the "
        "eight features alone; brackets hold 95 % intervals. It is a support vector machine: a "
        "policy moves in one way against each opponent, and no plane parts such clouds. A linear "
        "discriminant says how far planes get. It also answers with the bouts against one "
        "antagonist held out at a time: it has never seen the opponent it is asked about, which "
        "is harder, and closer to meeting a person."
    )
    return html.section(
        "Can a bout be told from another's?",
        tag("p", verdict),
        html.table(headers, rows, numbers=range(1, 6)),
        _confusion(three, three.random_folds, "The selected three, bouts held out at random"),
        html.details(
            "All policies, opponents held out",
            _confusion(
                summary.library_apart,
                summary.library_apart.by_opponent or summary.library_apart.random_folds,
                "All policies of the library",
            ),
        ),
    )


def _confusion(found: SeparabilityNote, accuracy: AccuracyNote, title: str) -> Html:
    rows: list[tuple[str, list[Html]]] = []
    for label, counts in zip(found.policies, accuracy.confusion, strict=True):
        total = sum(counts)
        cells = [
            tag("td", f"{count / total:.1%}", style=f"background: {_shade(count / total)}")
            for count in counts
        ]
        rows.append((label, cells))
    words = f"{title}: share of each policy's bouts (row) taken for each policy's."
    return html.matrix(words, [f"taken for {name}" for name in found.policies], rows)


def _diversity(summary: StylesSummary) -> Node:
    words = (
        f"Two policies of the library lie {_measure(summary.distance)} standard deviations from "
        "bout to bout apart, on average over pairs and features. The effective number of styles "
        "(Vendi score: 1 if all move alike, "
        f"{len(summary.library)} if none resembles another) is "
        f"{_measure(summary.effective_styles)}. Brackets: 95 % bootstrap intervals over bouts."
    )
    return html.section("Diversity of the library", tag("p", words))


def _bundle(summary: StylesSummary, bundle: Bundle) -> Node:
    rows = [
        (player.name, WARM_START if player.role == "warm_start" else f"round {player.round}",
         str(player.seed), tag("code", player.sha256[:16]))
        for player in bundle.players
    ]  # fmt: skip
    facts: list[tuple[Node, Node]] = [
        ("trained by", tag("code", summary.trained_by)),
        ("selected by", tag("code", summary.selected_by)),
        ("commit", tag("code", summary.commit or "unknown")),
        ("seed of the tournament", str(summary.tournament_seed)),
    ]
    return html.section(
        "The bundle",
        tag("p", "The run's ", tag("code", "bundle"), " folder holds these four snapshots."),
        html.table(("name", "what it is", "training seed", "SHA-256"), rows, numbers=(2,)),
        html.table(("", ""), facts),
    )


def _with_unit(feature: FeatureNote) -> str:
    unit = _written(feature.unit)
    return feature.title if unit == "1" else f"{feature.title} ({unit})"


def _written(unit: str) -> str:
    """Return a unit or formula with raised exponents."""
    return unit.replace("^2", "\N{SUPERSCRIPT TWO}").replace("^3", "\N{SUPERSCRIPT THREE}")


def _share(accuracy: AccuracyNote) -> str:
    return f"{accuracy.share:.1%} [{accuracy.low:.1%}, {accuracy.high:.1%}]"


def _measure(measure: MeasureNote) -> str:
    return f"{measure.value:.2f} [{measure.low:.2f}, {measure.high:.2f}]"


def _number(value: float) -> str:
    """Return three figures: ``123``, ``12.3``, ``1.23``."""
    size = abs(value)
    digits = 0 if size >= 100 else 1 if size >= 10 else 2
    return f"{value:,.{digits}f}".replace("-", "\N{MINUS SIGN}")


def _shade(share: float) -> str:
    return f"rgba(42, 143, 109, {0.05 + 0.55 * share:.2f})"
