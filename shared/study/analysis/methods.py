"""How the numbers were made, as a methods paragraph: versions, hashes, and what was decided."""

import platform
from importlib import metadata

import msgspec

from shared.runtime.build import commit
from shared.study.analysis.finding import ALPHA, CONFIDENCE
from shared.study.tables import Tables
from shared.telemetry.wording import listing

PACKAGES = ("riposte", "numpy", "scipy", "statsmodels", "pandas")


class Methods(msgspec.Struct, frozen=True, kw_only=True):
    """What is needed to get the same numbers again."""

    packages: dict[str, str]
    python: str
    commit: str
    """Of the code that analysed."""
    seed: int
    protocol: tuple[str, ...]
    """SHA-256 of the protocols that sessions began with; more than one is a deviation."""
    config: tuple[str, ...]
    """SHA-256 of the settings of games that count."""
    policies: tuple[str, ...]
    """Players that were met; in alphabetical order, which tells a blinded reader nothing."""
    commits: tuple[str, ...]
    """Of the code that ran the sessions."""


def methods_of(tables: Tables, seed: int) -> Methods:
    """Return how this study is analysed."""
    games = tables.games
    counted = [
        k for k, (outcome, is_recorded) in enumerate(
            zip(games["outcome"], games["is_recorded"].tolist(), strict=True))
        if outcome == "finished" and is_recorded
    ]  # fmt: skip

    def met(name: str) -> tuple[str, ...]:
        return tuple(sorted({games[name][k] for k in counted} - {""}))

    return Methods(
        packages={name: version for name in PACKAGES if (version := _version(name))},
        python=platform.python_version(),
        commit=commit(),
        seed=seed,
        protocol=tuple(sorted(set(tables.participants["protocol"]) - {""})),
        config=met("config"),
        policies=met("policy"),
        commits=met("commit"),
    )


def paragraph(methods: Methods, *, is_blinded: bool) -> str:
    """Return the methods paragraph."""
    packages = listing([f"{name} {version}" for name, version in methods.packages.items()])
    blinded = (
        "Conditions were analysed under blinded labels. " if is_blinded else "Conditions were "
        "analysed by name. "
    )  # fmt: skip
    return (
        f"Data were analysed with {packages} on Python {methods.python}. {blinded}"
        f"Tests are two-sided at {ALPHA:g} unless they say otherwise, intervals cover "
        f"{CONFIDENCE:.0%}. Scores of games that were void, repeated or warm-up are left out; "
        "nothing missing is filled in, and each test leaves out the people or games it lacks and "
        "says how many. Two conditions are compared within people by paired t-tests (effect d_z "
        "with its noncentral t interval; Shapiro-Wilk on the differences) with Wilcoxon's "
        "signed-rank test beside (Hodges-Lehmann interval); more than two by analysis of variance "
        "with repeated measures (statsmodels AnovaRM) whose degrees of freedom are always "
        "corrected by Greenhouse and Geisser's epsilon (Mauchly's test is shown), with Friedman's "
        "test and Kendall's W beside. Families of tests of one question are corrected by Holm. "
        "Learning is the slope of score on game number: one line through all games as in the "
        "paper (Shapiro-Wilk on residuals, Breusch-Pagan for equal variance), the same line with "
        "errors clustered by person, and each person's own line by least squares; conditions are "
        "compared by those own slopes within people, with Welch's test (Levene) and a mixed model "
        "beside, the model only where its fit converged. Correlations are Pearson's with "
        "Spearman's beside, and within people where a person gave several rows. Shares have exact "
        "binomial intervals; shares of games resample whole people. Assumptions are reported and "
        "decide nothing by themselves: where one fails, read the rank-based test. Bootstrap and "
        f"shuffles are seeded ({methods.seed})."
    )


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""
