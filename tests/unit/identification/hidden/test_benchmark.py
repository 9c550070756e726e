import json

import pytest

from benchmarks.identification import running
from benchmarks.identification.judging import judged
from benchmarks.identification.protocol import FIRST_SEED, protocol
from benchmarks.identification.running import by_turns, finished, run
from benchmarks.identification.table import checks_of, confusion, curve, taken_off, wilson
from shared.errors import RiposteError
from shared.sim.hidden.effect import hidden_effects


def cause(name, where="", value=1.0, low=0.9, high=1.1, quantity="size", others=None):
    return {
        "name": name, "where": where, "quantity": quantity, "value": value,
        "interval": [low, high], "others": others or {},
    }  # fmt: skip


def effect(name, where="", **values):
    values = values or {"size": [1.0, "kg"]}
    return {"name": name, "where": where, "share": 0.5, "values": values}


def record(cell="single", hidden=(), named=(), ties=(), verdict="named", key="k", unexplained=0):
    return {
        "key": key, "cell": cell, "hidden": list(hidden), "named": list(named),
        "ties": [list(tie) for tie in ties], "verdict": verdict, "unexplained": unexplained,
        "share_removed": 0.9, "cpu_s": 10.0, "base_fit": 2.0, "extended": 1.0,
    }  # fmt: skip


def test_the_right_effect_at_another_joint_is_half_right():
    found = judged(record(hidden=[effect("spring", "elbow")], named=[cause("spring", "wrist")]))
    assert (found.has_effect, found.has_place, found.false_names) == (True, False, 0)


def test_a_tie_with_the_hidden_effect_is_no_false_name_and_one_without_it_is():
    hidden = [effect("spring", "elbow")]
    tie = [cause("bias", "elbow"), cause("spring", "elbow")]
    found = judged(record(hidden=hidden, ties=[tie], verdict="tie"))
    assert (found.has_tie, found.is_tied, found.has_effect) == (True, True, False)
    assert found.false_names == 0
    assert judged(record(hidden=hidden, ties=[[cause("a"), cause("b")]])).false_names == 1


def test_any_name_where_nothing_is_hidden_is_false():
    assert judged(record("null", named=[cause("payload")])).false_names == 1
    assert judged(record("null", verdict="none")).false_names == 0


def test_the_error_of_a_vector_is_that_of_all_numbers_in_its_unit():
    hidden = effect("frame", x=[3.0, "m"], y=[4.0, "m"], turn=[9.0, "rad"])
    named = cause("frame", quantity="x", value=3.0, others={"y": 3.0, "turn": 1.0})
    assert judged(record(hidden=[hidden], named=[named])).errors == pytest.approx((0.2,))


@pytest.mark.parametrize(
    ("error", "said"), [(ValueError("no end"), "ValueError('no end')"), (RiposteError("a"), "a")]
)
def test_a_data_set_that_ends_in_an_error_does_not_end_the_run(error, said, monkeypatch, capsys):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(running, "hide", fail)
    trial = protocol(0.05)[0]
    found = running.one((trial, False, None))
    assert found is not None
    assert (found["key"], found["error"]) == (trial.key, said)
    assert "Traceback" in capsys.readouterr().err


def test_an_interval_covers_or_does_not():
    hidden = [effect("payload")]
    assert judged(record(hidden=hidden, named=[cause("payload")])).covered == (True,)
    missed = cause("payload", value=1.2, low=1.1, high=1.3)
    assert judged(record(hidden=hidden, named=[missed])).covered == (False,)


def test_cells_take_turns_in_what_is_cut_short():
    ordered = by_turns(protocol(0.05))
    assert sorted(each.key for each in ordered) == sorted(each.key for each in protocol(0.05))
    half = [each.cell for each in ordered[: len(ordered) // 2]]
    assert half.count("null") in (2, 3)  # of five
    assert half.count("two") in (1, 2)  # of three
    assert len(half) / 2 < half.count("single") < len(half)


def test_what_is_cut_short_is_of_many_effects_and_both_arms():
    singles = [each for each in by_turns(protocol()) if each.cell == "single"][:40]
    assert len({each.recipe.wishes[0].name for each in singles}) > 20
    assert {each.recipe.arm for each in singles} >= {"pr2", "arm3"}


def test_what_came_to_the_protocol_later_runs_after_all_else_and_changes_none_of_its_seeds():
    trials = by_turns(protocol())
    later = [each for each in trials if each.is_later]
    assert later
    assert trials[-len(later) :] == later
    seeds = {each.recipe.seed for each in trials if not each.is_later and each.cell == "single"}
    assert all(each.recipe.seed > max(seeds) for each in later)
    assert [each.key for each in trials[:2]] == KEPT


KEPT = ["single/torque_gain/pr2/22611", "single/encoder_offset/pr2/21118"]
"""The order that rows of the results are of, which ``--skip`` counts in."""


def test_no_trial_is_begun_after_the_time_is_up(tmp_path):
    path = tmp_path / "records.jsonl"
    path.write_text(json.dumps(record(key=protocol(0.05)[3].key)) + "\n")
    found = run(protocol(0.05), path, 0, processes=1, minutes=0.0)
    assert [each["key"] for each in found] == [protocol(0.05)[3].key]


def test_data_sets_that_earlier_rows_are_of_can_be_left_out(tmp_path):
    path = tmp_path / "records.jsonl"
    order = by_turns(protocol(0.05))
    path.write_text("".join(json.dumps(record(key=each.key)) + "\n" for each in order[:4]))
    found = run(protocol(0.05), path, 0, processes=1, minutes=0.0, skipped=3)
    assert [each["key"] for each in found] == [order[3].key]


def test_one_part_of_the_protocol_can_be_run_alone(tmp_path):
    path = tmp_path / "records.jsonl"
    order = by_turns(protocol(0.05))
    path.write_text("".join(json.dumps(record(key=each.key)) + "\n" for each in order))
    found = run(protocol(0.05), path, 0, processes=1, minutes=0.0, cells=("tie",))
    assert [each["key"] for each in found] == [each.key for each in order if each.cell == "tie"]


def test_ties_are_of_causes_that_no_gain_is_off_enough_for():
    ties = [each for each in protocol() if each.cell == "tie"]
    assert {each.recipe.reach for each in ties} == {0.08}
    for each in ties:
        (wish,) = each.recipe.wishes
        most = {"torque_bias": 6.0, "counterbalance": 1.0}[wish.name]
        assert 0.69 < wish.size / most < 1.0


def test_a_tie_is_counted_and_whether_what_it_asks_for_tells_it():
    hidden = [effect("bias", "elbow")]
    tie = [cause("bias", "elbow"), cause("spring", "elbow")]
    tied = record("tie", hidden=hidden, ties=[tie], verdict="tie")
    records = [
        {**tied, "is_told_apart": True},
        {**tied, "is_told_apart": False},
        record("tie", hidden=hidden, verdict="none"),
    ]
    values = {check.name: check.value for check in checks_of(records)}
    assert values["structural tie reported (n = 3)"] == pytest.approx(2 / 3)
    assert values["what a tie asks for tells it (n = 2)"] == 0.5


def test_rates_of_the_table_are_those_of_the_records():
    hidden = [effect("payload")]
    records = [
        record(hidden=hidden, named=[cause("payload")]),
        record(hidden=hidden, verdict="none"),
        record("null", verdict="none"),
        record("null", named=[cause("payload")]),
        {"key": "x", "cell": "single", "error": "what went wrong"},
    ]
    values = {check.name: check.value for check in checks_of(records)}
    assert values["right effect (n = 2)"] == 0.5
    assert values["false names, base right (n = 2)"] == 0.5
    assert values["data sets that ended in an error"] == 1
    assert not any(name.startswith("both of two") for name in values)
    assert confusion(records) == {
        "payload": {"payload": 1, "(none)": 1},
        "(nothing)": {"(none)": 1, "payload": 1},
    }


def test_an_effect_counts_by_what_it_takes_off_what_the_base_fit_leaves():
    hidden = [effect("payload")]
    right = record(hidden=hidden, named=[cause("payload")])
    missed = record(hidden=hidden, verdict="none")
    once = record(hidden=[effect("tracker_slip", "a")], named=[cause("tracker_slip", "a")])
    records = [right, {**missed, "explainable": 0.01}, {**missed, "explainable": 0.3}]
    assert [taken_off(each) for each in (*records, once)] == [0.75, 0.01, 0.3, 0.5]
    (able,) = [check for check in checks_of(records) if "take 2% off" in check.name]
    assert able.value == 0.5
    assert able.name.endswith("(n = 2)")
    assert [(each["to"], each["n"], each["named"]) for each in curve(records)] == [
        (0.02, 1, 0.0), (0.4, 1, 0.0), (1.0, 1, 1.0),
    ]  # fmt: skip


def test_what_the_finder_explains_is_a_share_of_what_the_truth_does():
    hidden = [effect("payload")]
    right = record(hidden=hidden, named=[cause("payload")])
    half, all_of_it = ({**right, "explainable": share} for share in (0.9, 0.7))
    too_small = {**right, "explainable": 0.01, "extended": 2.0}
    values = {check.name: check.value for check in checks_of([half, all_of_it, too_small])}
    assert values["explainable removed, median"] == pytest.approx((0.75 / 0.9 + 1.0) / 2)


def test_an_interval_of_a_rate_is_wilsons():
    assert wilson(0, 10) == pytest.approx((0.0, 0.278), abs=1e-3)
    assert wilson(21, 24) == pytest.approx((0.690, 0.957), abs=2e-3)


def test_the_protocol_has_every_effect_and_seeds_of_its_own():
    trials = protocol(0.05)
    assert len({trial.key for trial in trials}) == len(trials)
    assert all(trial.recipe.seed >= FIRST_SEED for trial in trials)
    singles = [trial.recipe.wishes[0].name for trial in trials if trial.cell == "single"]
    assert set(singles) == set(hidden_effects())
    outside = [trial for trial in trials if trial.cell == "outside"]
    assert all(trial.without == {trial.recipe.wishes[0].name} for trial in outside)


def test_another_series_asks_the_same_of_other_data_sets():
    first, second = (by_turns(protocol(0.05, series)) for series in (1, 2))
    assert not {each.recipe.seed for each in first} & {each.recipe.seed for each in second}
    alike = [
        [(each.cell, each.recipe.arm, each.recipe.wishes) for each in of] for of in (first, second)
    ]
    assert alike[0] == alike[1]


def test_the_whole_protocol_has_the_numbers_of_the_issue():
    counts = {}
    for trial in protocol():
        counts[trial.cell] = counts.get(trial.cell, 0) + 1
    assert counts["single"] == 20 * len(hidden_effects()) >= 400
    assert {name: counts[name] for name in ("null", "null_imperfect", "two", "outside", "tie")} == {
        "null": 100, "null_imperfect": 100, "two": 60, "outside": 40, "tie": 20,
    }  # fmt: skip


def test_a_line_that_a_crash_cut_off_is_done_again(tmp_path):
    path = tmp_path / "records.jsonl"
    whole = json.dumps(record())
    path.write_text(f'{whole}\n{{"key": "cut', encoding="utf-8")
    assert [each["key"] for each in finished(path)] == ["k"]
    assert finished(tmp_path / "none.jsonl") == []
