"""The report as one self-contained HTML page: summary, chapters, methods."""

from collections.abc import Sequence

from shared.study.analysis.chapter import (
    Chapter,
    Table,
    interval_text,
    number_text,
    p_text,
)
from shared.study.analysis.finding import Estimate, Finding
from shared.study.analysis.methods import Methods, paragraph
from shared.telemetry import html
from shared.telemetry.html import Html, Node, tag

P_COLUMNS = ("p", "p (Holm)", "p, clustered by person")


def report_page(title: str, is_blinded: bool, methods: Methods, chapters: Sequence[Chapter]) -> str:
    """Return the whole page."""
    return html.page(
        f"Riposte: {title}",
        _head(title, is_blinded, chapters),
        [_chapter(chapter) for chapter in chapters],
        _methods(methods, is_blinded=is_blinded),
    )


def _head(title: str, is_blinded: bool, chapters: Sequence[Chapter]) -> Node:
    shown = "conditions under blinded labels" if is_blinded else "conditions by name"
    said = [
        tag("li", tag("b", f"{chapter.title}. "), " ".join(said))
        for chapter in chapters
        if (said := chapter.says[: chapter.headlines])
    ]
    return [
        tag("h1", title),
        tag("p", f"What the recordings say · {shown}", class_="soft"),
        tag("ul", said),
        tag("p", "Every p is of one study. Not significant does not mean that there is nothing: "
            "look at the interval.", class_="soft"),
    ]  # fmt: skip


def _chapter(chapter: Chapter) -> Html:
    return html.section(
        chapter.title,
        tag("ul", [tag("li", sentence) for sentence in chapter.says]) if chapter.says else None,
        [html.figure(html.svg(picture.draw()), picture.caption) for picture in chapter.pictures],
        [_table(table) for table in chapter.tables],
        _tests(chapter.findings),
    )


def _table(table: Table) -> Node:
    numbers = [
        k
        for k in range(1, len(table.columns))
        if any(row[k] is not None for row in table.rows)
        and all(isinstance(row[k], int | float | None) or _is_share(row[k]) for row in table.rows)
    ]
    places = [_places([row[k] for row in table.rows]) for k in range(len(table.columns))]
    rows = [
        [_cell(value, table.columns[k], places[k]) for k, value in enumerate(row)]
        for row in table.rows
    ]
    made = html.table(table.columns, rows, numbers=numbers, caption=table.note or None)
    if table.is_folded:
        return html.details(table.title, made)
    return [tag("h3", table.title), made]


def _places(column: Sequence[str | float | int | None]) -> int:
    """Return how many decimals a column needs, so that its points stand under each other."""
    texts = [f"{value:.6g}" for value in column if isinstance(value, float)]
    return max((len(t.partition(".")[2]) for t in texts if "e" not in t), default=0)


def _cell(value: str | float | int | None, column: str, places: int) -> str:
    if value is None:
        return "-"
    if isinstance(value, str):
        return value
    if column in P_COLUMNS:
        return p_text(float(value))
    if isinstance(value, int):
        return f"{value:,}".replace("-", "\N{MINUS SIGN}")
    if value and not 1e-4 <= abs(value) < 1e9:
        return f"{value:.3g}".replace("-", "\N{MINUS SIGN}")
    return f"{value:,.{places}f}".replace("-", "\N{MINUS SIGN}")


def _is_share(value: str | float | int | None) -> bool:
    return isinstance(value, str) and value[:1].isdigit() and " %" in value and "to" not in value


def _tests(findings: Sequence[Finding]) -> Node:
    if not findings:
        return None
    rows: list[list[Node]] = []
    for finding in findings:
        rows.append(_row(finding, is_beside=False))
        rows += [_row(beside, is_beside=True) for beside in finding.beside]
    headers = ("question and test", "n", "statistic", "p", "p (Holm)", "estimate (95 %)",
               "effect size (95 %)", "assumptions")  # fmt: skip
    caption = (
        "Under each test, in grey, the rank-based test or another of the same question. "
        "An assumption that the data speak against (p below 0.05) is marked."
    )
    return html.details("Every test", html.table(headers, rows, numbers=(1,), caption=caption))


def _row(finding: Finding, *, is_beside: bool) -> list[Node]:
    soft = "soft" if is_beside else None
    notes = [text for text in (*finding.left_out, finding.note) if text]
    name: Node = (
        tag("span", f"beside: {finding.test}", class_="soft")
        if is_beside
        else [tag("b", finding.question), tag("br"), finding.test]
    )
    checks = [
        [
            tag("span", f"{check.assumption}: {check.test} p {p_text(check.p)}",
                class_=None if check.holds else "bad"),
            tag("br"),
        ]
        for check in finding.checks
    ]  # fmt: skip
    return [
        [name, [[tag("br"), tag("span", text, class_="soft")] for text in notes]],
        tag("span", f"{finding.n:,} {finding.unit}", class_=soft),
        tag("span", _statistic(finding), class_=soft),
        _p(finding.p, soft, is_decisive=finding.p_adjusted is None),
        _p(finding.p_adjusted, soft, is_decisive=True),
        tag("span", _estimate(finding.estimate), class_=soft),
        tag("span", _estimate(finding.effect), class_=soft),
        checks,
    ]


def _p(value: float | None, soft: str | None, *, is_decisive: bool) -> Html:
    text = "" if value is None else p_text(value).replace(" ", "\N{NO-BREAK SPACE}")
    if value is not None and value < 0.05 and is_decisive and soft is None:
        return tag("b", text)
    return tag("span", text, class_=soft)


def _statistic(finding: Finding) -> str:
    if finding.statistic is None:
        return "-"
    df = ", ".join(f"{value:.4g}" for value in finding.df)
    name = f"{finding.symbol}({df})" if df else finding.symbol
    digits = 3 if finding.df or not finding.statistic.is_integer() else 1
    value = number_text(finding.statistic, max(digits, len(f"{abs(finding.statistic):.0f}")))
    return f"{name} = {value}"


def _estimate(estimate: Estimate | None) -> str:
    if estimate is None:
        return "-"
    interval = interval_text(estimate)
    text = f"{estimate.name} {number_text(estimate.value)}"
    return f"{text} ({interval})" if interval else text


def _methods(methods: Methods, *, is_blinded: bool) -> Html:
    facts: list[tuple[Node, Node]] = [
        ("analysed with", ", ".join(f"{n} {v}" for n, v in methods.packages.items())),
        ("commit of the analysis", tag("code", methods.commit or "unknown")),
        ("protocol (SHA-256)", _codes(methods.protocol)),
        ("settings (SHA-256)", _codes(methods.config)),
        ("policies", _codes(methods.policies)),
        ("commits of the sessions", _codes(methods.commits)),
    ]
    warnings = [
        tag("p", f"Sessions had {len(values)} different {what}: a deviation to report.",
            class_="bad")
        for what, values in (("protocols", methods.protocol), ("settings", methods.config),
                             ("commits", methods.commits))
        if len(values) > 1
    ]  # fmt: skip
    return html.section(
        "Methods",
        tag("p", paragraph(methods, is_blinded=is_blinded)),
        warnings,
        html.table(("", ""), facts),
    )


def _codes(values: Sequence[str]) -> Node:
    if not values:
        return "-"
    return [[tag("code", value), tag("br")] for value in values]
