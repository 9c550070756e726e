"""The report says what verdict and evidence say, whatever things are called."""

import functools
import html
import re
from dataclasses import replace
from html.parser import HTMLParser

import msgspec
import pytest

from services.jobs.identify import words
from services.jobs.identify.page import About, report_page
from shared.identification.verdict import Word
from tests.unit.identify_job.examples import FRICTION, JOINTS, WORDS, Example, example

HOSTILE = (
    "<script>alert(1)</script>", "a&b \"quoted\" 'name'", "$\\frac{$", "_hidden", "関節 \u0007",
    "</svg><img src=x onerror=alert(1)>", "x" * 200,
)  # fmt: skip


class Reader(HTMLParser):
    """Collects elements and text; figures apart."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[str] = []
        self.rows: list[list[str]] = []
        self.text = ""
        self.figures = ""
        self._in_svg = 0
        self._in_cell = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [name for name, _ in attrs]
        self._in_svg += tag == "svg"
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
            self._in_cell = True

    def handle_endtag(self, tag: str) -> None:
        self._in_svg -= tag == "svg"
        self._in_cell = self._in_cell and tag not in ("td", "th")

    def handle_data(self, data: str) -> None:
        if self._in_svg:
            self.figures += data
            return
        self.text += data
        if self._in_cell:
            self.rows[-1][-1] += data


@functools.cache
def page_of(word: Word) -> Reader:
    """Return the page of an example, drawn once."""
    return read(example(word))


def read(found: Example, name: str = "friday") -> Reader:
    about = About(name, f"riposte identify {name}", "model.toml", found.carried)
    reader = Reader()
    reader.feed(report_page(found.verdict, found.evidence, about))
    return reader


@pytest.mark.parametrize("word", WORDS)
def test_every_verdict_has_a_page_that_says_it(word: Word) -> None:
    found, page = example(word), page_of(word)
    assert words.title_text(found.verdict) in page.text
    assert found.verdict.sentence in page.text
    for sentence in (*found.verdict.record_next, *found.verdict.caveats):
        assert sentence in page.text
    held_out = found.verdict.held_out
    for stage, name in (("nominal", "nominal"), ("base_fit", "base fit"), ("extended", "extended")):
        row = next(row for row in page.rows if row[:1] == [name])
        assert row[1:] == [
            words.number_text(getattr(held_out, stage)),
            words.number_text(held_out.joints_mrad[stage]),
            words.number_text(held_out.tracker_mm[stage]),
        ]
    assert ("One of these" in page.text) == bool(found.verdict.ties)
    assert ("Beware" in page.text) == (not found.verdict.starts_agree)
    assert ("The cause" in page.text) == bool(found.verdict.causes)


def test_of_an_arm_that_is_told_torques_two_measures_are_told_apart() -> None:
    found = example("named")
    assert "runs away" not in read(found).text
    parts = replace(found, evidence=replace(found.evidence, is_in_parts=True))
    assert "The angles are how far off it is until the next time" in read(parts).text


def test_each_cause_is_there_with_its_interval() -> None:
    found, page = example("named"), page_of("named")
    for cause in found.verdict.causes:
        assert words.quantity_text(cause.value, cause.unit, cause.interval) in page.text
        assert cause.signature in page.text
        assert words.share_text(cause.share, cause.share_interval) in page.text
    assert "30.4 ms (29.8 to 31)" in page.text
    assert "0.612 N m (0.588 to 0.636)" in page.text


def test_every_candidate_is_there_with_its_scores_and_why_not() -> None:
    found, page = example("named"), page_of("named")
    for each in found.verdict.candidates:
        label = f"{each.effect} {each.where}".strip()
        row = next(row for row in page.rows if row[:1] == [label] and len(row) == 5)
        assert row[1] == words.share_text(each.screen)
        assert row[2].split(" ")[0] == ("-" if each.gain is None else words.number_text(each.gain))
        is_named = any(
            (cause.effect, cause.where) == (each.effect, each.where)
            for cause in found.verdict.causes
        )
        assert row[4] == ("named" if is_named else each.why_not)
    for effect, why in found.verdict.ruled_out.items():
        assert [effect, why] in page.rows


def test_what_would_have_been_named_is_there_with_where_it_shows_least() -> None:
    rows = page_of("none").rows
    assert ["the tool is heavier than the model says", "mass from 34 g", "", ""] in rows
    gain = ["the drive gives another torque", "share from 21 % (elbow_flex)", "", "wrist_roll"]
    assert gain in rows
    assert "What would have been named" in page_of("none").text
    assert "What else would have been named" in page_of("named").text
    assert "have been named" not in page_of("unexplained").text


def test_what_is_unexplained_is_located() -> None:
    found, page = example("unexplained"), page_of("unexplained")
    for number, left in enumerate(found.verdict.unexplained):
        row = next(row for row in page.rows if row and row[0] == "AB"[number])
        assert row[1:5] == [
            left.where, left.trajectory,
            f"{words.number_text(left.begin)} to {words.number_text(left.end)}", left.phase,
        ]  # fmt: skip
    assert "swings test" in page.figures


def test_both_causes_of_a_tie_and_what_tells_them_apart_are_there() -> None:
    found, page = example("tie"), page_of("tie")
    tie = found.verdict.ties[0]
    for cause in tie.causes:
        assert any(row[:1] == [cause.title] for row in page.rows)
    assert tie.record in page.text
    assert "alike to 0.998" in page.text


@pytest.mark.slow
def test_a_sure_cause_is_shown_beside_a_tie() -> None:
    found = example("tie")
    verdict = msgspec.structs.replace(found.verdict, causes=(FRICTION,))
    page = read(replace(found, verdict=verdict))
    assert "A cause was found, and one of several beside" in page.text
    assert FRICTION.signature in page.text
    assert "The cause" in page.text
    assert "One of these" in page.text
    for cause in verdict.ties[0].causes:
        assert any(row[:1] == [cause.title] for row in page.rows)


def test_every_base_parameter_is_there_before_and_after() -> None:
    found, page = example("named"), page_of("named")
    for value in found.verdict.base:
        row = next(row for row in page.rows if row[:1] == [value.name])
        assert row[2:5] == [
            words.number_text(each) for each in (value.nominal, value.base_fit, value.extended)
        ]


@pytest.mark.slow
def test_a_data_set_without_a_tracker_has_none_on_its_page() -> None:
    page = read(example("none", has_tracker=False))
    assert "tracker" not in page.figures
    assert "tracker, mm" not in page.text
    assert "tracker (mm)" in page_of("none").figures


def test_hostile_names_stay_text() -> None:
    page = read(example("named", HOSTILE), name="<iframe>")
    assert not {"script", "img", "iframe"} & set(page.tags)
    assert not [name for name in page.attributes if name.startswith("on")]
    assert "<iframe>" in page.text
    assert HOSTILE[0] in page.figures


@pytest.mark.slow
def test_an_arm_of_one_joint_that_slides_has_a_page() -> None:
    found = example("named", ("cart",), has_tracker=False)
    evidence = found.evidence
    slid = Example(
        found.verdict,
        type(evidence)(**{**vars(evidence), "units": ("m",)}),
        found.carried,
    )
    page = read(slid)
    assert "cart (m)" in page.figures
    assert "mrad" not in page.figures
    assert ["stage", "x noise", "joints, mm"] in page.rows


@pytest.mark.slow
def test_a_simulation_that_diverged_is_shown_as_that() -> None:
    found = example("named")
    for replay in found.evidence.replays:
        replay.predicted["nominal"][200:] = float("nan")
    held_out = msgspec.structs.replace(found.verdict.held_out, nominal=float("inf"))
    verdict = msgspec.structs.replace(found.verdict, held_out=held_out)
    page = read(Example(verdict, found.evidence, found.carried))
    assert "diverged" in page.figures


@pytest.mark.slow
def test_the_page_asks_for_nothing_and_repeats_itself() -> None:
    found = example("none")
    about = About("friday", "riposte identify friday", "model.toml", found.carried)
    page = report_page(found.verdict, found.evidence, about)
    assert page == report_page(found.verdict, found.evidence, about)
    assert html.escape("default-src 'none'") in page
    links = re.findall(r"""(?:src|href)=["']([^"'#]*)""", page)
    assert all(link.startswith(("data:", "#")) or not link for link in links)
    assert len(page) < 1_000_000


def test_a_page_without_a_measured_noise_floor_never_speaks_of_one() -> None:
    found = example("unexplained")
    held_out = msgspec.structs.replace(found.verdict.held_out, is_floor_measured=False)
    verdict = msgspec.structs.replace(found.verdict, held_out=held_out)
    evidence = replace(found.evidence, noise_from_repeats=False)
    page = read(Example(verdict, evidence, found.carried))
    said = (page.text + page.figures).replace("noise floor, not measured", "")
    assert said.count("noise floor") == 1  # the name of a step, in the table of times
    assert page.figures.count("what the base fit usually leaves") >= 3
    assert "noise floor" in page_of("unexplained").figures


def test_the_joints_are_those_of_the_evidence() -> None:
    page = page_of("none")
    assert all(joint in page.figures for joint in JOINTS)
