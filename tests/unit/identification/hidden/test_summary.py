from benchmarks.identification import summary
from benchmarks.identification.summary import BEGIN, END, described, kept, main, outcomes, rates
from shared.runtime.build import SOURCE_ROOT
from shared.telemetry.naming_figures import naming


def record(name="spring", where="elbow", named=(), ties=(), verdict="named", cell="single"):
    cause = {"quantity": "k", "value": 1.0, "interval": [0.9, 1.1], "others": {}}
    return {
        "key": "k", "cell": cell, "verdict": verdict, "unexplained": 0, "cpu_s": 1.0,
        "hidden": [{"name": name, "where": where, "share": 0.5, "values": {"k": [1.0, "N"]}}],
        "named": [{"name": one, "where": at, **cause} for one, at in named],
        "ties": [[{"name": one, "where": "", **cause} for one in tie] for tie in ties],
        "base_fit": 2.0, "extended": 1.0, "explainable": 0.7, "share_removed": 1.0,
    }  # fmt: skip


RECORDS = [
    record(named=[("spring", "elbow")]),
    record(named=[("spring", "wrist")]),
    record(named=[("bias", "elbow")]),
    record(ties=[["bias", "spring"]], verdict="tie"),
    record(verdict="none"),
    record(verdict="base_too_coarse"),
    record(ties=[["bias", "tilt"]], verdict="tie"),
    record("drag", named=[("drag", "elbow")]),
    record("drag", cell="outside", verdict="unexplained"),
]


def test_each_data_set_counts_once_and_what_is_always_named_comes_first():
    drag, spring = outcomes(RECORDS)
    assert (drag.label, drag.counts) == ("drag", {"right": 1})
    assert spring.counts == {"right": 1, "wrong": 3, "tie": 1, "no name": 2}


def test_goals_that_are_not_reached_are_bold():
    lines = described(RECORDS).splitlines()
    (right,) = [line for line in lines if line.startswith("| effect and place")]
    found = "**0.25 [0.0715, 0.591]**, n = 8"
    assert right == f"| effect and place | at least 0.85 | {found} | {found} |"
    assert "| drag | 1 of 1 |  |" in lines
    assert "| spring | 2 of 7 | (tie) 2, bias 1, (none) 1, (base_too_coarse) 1 |" in lines


def test_what_the_last_ones_say_stands_beside_what_all_do(monkeypatch):
    monkeypatch.setattr(summary, "LAST", 1)
    lines = described([*RECORDS, record(named=[("spring", "elbow")])]).splitlines()
    assert lines[0] == "| Figure | Goal | All 10 | The last 1 |"
    (right,) = [line for line in lines if line.startswith("| effect and place")]
    now = "1 [0.207, 1], n = 1"
    assert (
        right == f"| effect and place | at least 0.85 | **0.333 [0.121, 0.646]**, n = 9 | {now} |"
    )
    (outside,) = [line for line in lines if line.startswith("| outside: unexplained")]
    assert outside.endswith("n = 1 |  |")


def test_rates_have_their_intervals():
    (rate,) = rates(RECORDS)
    assert (rate.low, rate.high, rate.count) == (0.4, 1.0, 8)
    low, high = rate.interval
    assert low < rate.value < high


def test_the_picture_can_be_drawn():
    assert naming(outcomes(RECORDS), rates(RECORDS), 0.9).startswith(b"\x89PNG")


def test_the_document_says_what_the_kept_records_do():
    text = (SOURCE_ROOT / "docs" / "identify_results.md").read_text("utf-8")
    assert f"{BEGIN}\n{described(kept())}\n{END}" in text


def test_a_document_without_markers_is_refused(tmp_path, monkeypatch, capsys):
    picture = tmp_path / "picture.png"
    monkeypatch.setattr(summary, "PICTURE", picture)
    bare = tmp_path / "page.md"
    bare.write_text("nothing\n", "utf-8")
    assert main([str(bare)]) == 2
    assert BEGIN in capsys.readouterr().err
    assert not picture.exists()
    assert main([]) == 2
