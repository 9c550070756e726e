"""Prometheus itself computes the rules: each alert on series that raise it, and on a quiet run."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.unit.deploy.found import DEPLOY, documents
from tests.unit.deploy.test_monitoring import EXPORTED, LABELS, RECORDED, rules

EXAMPLES = Path(__file__).with_name("rules_test.yml")
ALERTS = {rule["alert"] for rule in rules() if "alert" in rule}

needs_promtool = pytest.mark.skipif(
    shutil.which("promtool") is None, reason="needs promtool: apt install prometheus"
)


def promtool(*words: str | Path) -> str:
    done = subprocess.run(
        ["promtool", *words], capture_output=True, text=True, timeout=100, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@needs_promtool
def test_rules_and_configuration_are_what_prometheus_reads():
    promtool("check", "rules", DEPLOY / "prometheus/rules.yml")
    promtool("check", "config", "--syntax-only", DEPLOY / "prometheus/prometheus.yml")


@needs_promtool
def test_every_alert_comes_when_it_should_and_not_before():
    promtool("test", "rules", EXAMPLES)


@needs_promtool
def test_a_rule_that_is_wrong_is_noticed(tmp_path: Path):
    text = (DEPLOY / "prometheus/rules.yml").read_text()
    (tmp_path / "rules.yml").write_text(
        text.replace("> 15\n        for: 15s", "> 60\n        for: 15s")
    )
    examples = EXAMPLES.read_text().replace("../../../deploy/prometheus/rules.yml", "rules.yml")
    (tmp_path / "rules_test.yml").write_text(examples)
    with pytest.raises(AssertionError, match="RiposteServiceSilent"):
        promtool("test", "rules", tmp_path / "rules_test.yml")


def test_the_examples_raise_every_alert_keep_every_one_quiet_and_know_the_endpoints_names():
    (made,) = documents(EXAMPLES)
    raised: set[str] = set()
    quiet: set[str] = set()
    computed: set[str] = set()
    for example in made["tests"]:
        for case in example.get("alert_rule_test", []):
            (raised if case.get("exp_alerts") else quiet).add(case["alertname"])
        computed |= {case["expr"] for case in example.get("promql_expr_test", [])}
        for series in example["input_series"]:
            name, _, inside = series["series"].partition("{")
            assert name in EXPORTED | {"up"}, name
            assert set(re.findall(r'(\w+)="', inside)) <= LABELS, series["series"]
    assert raised == quiet == ALERTS
    assert computed == RECORDED
