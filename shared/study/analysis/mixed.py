"""Both conditions' learning in one mixed model, kept only where its fit converged.

The default optimiser of statsmodels stops early on random slopes and then gives any p; what it
gives is used only where it says that it converged, and beside it stands the test of slopes.
"""

# pyright: basic
# (scipy's and statsmodels' types are partial)

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from statsmodels.regression.mixed_linear_model import MixedLM, MixedLMParams
from statsmodels.tools.sm_exceptions import ConvergenceWarning

from shared.study.analysis.finding import Estimate, Finding, missing_text, not_done
from shared.study.analysis.intervals import TAIL
from shared.study.analysis.paired import FEWEST

Floats = NDArray[np.float64]
TEST = "mixed model, condition x game"
TERMS = ("intercept", "condition", "game", "condition x game")
RANDOM = ((0, 1, 2, 3), (0, 1, 3), (0, 1))
"""Which terms vary from person to person, tried in this order until a fit converges: a variance
that the data cannot tell from zero is what keeps it from that (Bates et al. 2015,
arXiv:1506.04967). Game goes first, because only condition x game bears on the question."""
SAME = 1.05
"""Times the variance that games alone give; above it, people's differences of slope vary."""
OPTIMISER = "lbfgs"
"""Follows the gradient; powell and nm also move the covariances that are fixed at zero here, and
fit another model than they were asked for."""


def mixed_slopes(games: Floats, first: Floats, second: Floats, question: str) -> Finding:
    """Return how much steeper scores rise in the first condition, by a linear mixed model.

    Fixed: condition, game, condition x game. Random by person, independent of each other: the
    same and an intercept, less what keeps the fit from converging. Restricted maximum likelihood;
    p and interval by t, z is too sure with few people: with people - 1 degrees of freedom where
    people differ in the difference of their slopes, with those of the games where they do not.

    Args:
        games: float64[k], game numbers.
        first: float64[n, k], scores; NaN where a game is missing.
        second: float64[n, k], of the same people.
        question: what is asked.
    """
    cube = np.stack([first, second], axis=1)
    there = np.isfinite(cube)
    person, condition, column = np.nonzero(there)
    y = cube[there]
    people = len(np.unique(person))
    left_out = missing_text(cube.size - len(y), "games", "no score")
    if people < FEWEST or len(y) < 8 * FEWEST or np.ptp(y) == 0.0:
        return not_done(question, TEST, people, "too few people or games", left_out=left_out)
    side: Any = 0.5 - condition
    rise = (games[column] - games.mean()) / max(float(np.std(games)), 1e-12)
    design: Any = np.column_stack([np.ones(len(y)), side, rise, side * rise])
    scale = float(np.std(y))
    fits = ((terms, _fit(y / scale, design, list(terms), person)) for terms in RANDOM)
    terms, fit = next(((terms, fit) for terms, fit in fits if fit is not None), ((), None))
    if fit is None:
        why = "no fit converged; judge by the test of slopes"
        return not_done(question, TEST, people, why, left_out=left_out)
    unit = scale / max(float(np.std(games)), 1e-12)
    value, error = float(fit.fe_params[3]) * unit, float(fit.bse_fe[3]) * unit
    within = float(fit.scale * np.linalg.inv(design.T @ design)[3, 3])
    is_varying = float(fit.bse_fe[3]) ** 2 > SAME * within
    t = value / error
    df = people - 1.0 if is_varying else max(people - 1.0, float(len(y) - len(TERMS) * people))
    half = float(stats.t.ppf(1.0 - TAIL, df)) * error
    return Finding(
        question=question,
        test=TEST,
        n=people,
        symbol="t",
        statistic=t,
        df=(df,),
        p=float(2.0 * stats.t.sf(abs(t), df)),
        estimate=Estimate(
            name="difference of slopes", value=value, low=value - half, high=value + half,
            method="REML, t",
        ),
        left_out=left_out,
        note=f"varying by person: {', '.join(TERMS[k] for k in terms)}; converged",
    )  # fmt: skip


def _fit(y: Floats, design: Any, terms: list[int], person: NDArray[np.intp]) -> Any:
    """Return the fit where it converged and has finite errors, else None."""
    fixed: Any = np.ones(design.shape[1])
    model = MixedLM(y, design, groups=person, exog_re=design[:, terms])
    free = MixedLMParams.from_components(fixed, np.eye(len(terms)))  # no covariances
    with warnings.catch_warnings():
        # Each of them says what `converged` and the errors say again.
        for kind in (ConvergenceWarning, RuntimeWarning, UserWarning):
            warnings.simplefilter("ignore", kind)
        try:
            fit: Any = model.fit(method=OPTIMISER, free=free, reml=True)
        except np.linalg.LinAlgError:
            return None
    is_good = fit.converged and np.isfinite(fit.bse_fe).all() and (fit.bse_fe > 0.0).all()
    return fit if is_good else None
