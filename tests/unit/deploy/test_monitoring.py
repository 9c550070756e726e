"""Rules, alerts and the dashboard name only what the endpoint exports."""

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest

from services.metrics.families import FAMILIES
from services.router.service import REFUSED
from shared.bus.counters import NAMES
from tests.unit.deploy.found import DEPLOY, ROOT, documents, pods

EXPORTED = {family.name for family in FAMILIES}
LABELS = {
    "role", "name", "host", "version", "boot", "on", "rate", "counter", "run", "phase", "agent",
    "bound", "job",
}  # fmt: skip
"""Those of `services/metrics/families.py`, and Prometheus' own."""


def rules() -> list[dict[str, Any]]:
    (made,) = documents(DEPLOY / "prometheus/rules.yml")
    return [rule for group in made["groups"] for rule in group["rules"]]


RECORDED = {rule["record"] for rule in rules() if "record" in rule}


def queries() -> Iterator[tuple[str, str]]:
    for rule in rules():
        yield rule.get("alert") or rule["record"], rule["expr"]
    board = json.loads((DEPLOY / "grafana/dashboards/riposte.json").read_text())
    for panel in board["panels"]:
        for target in panel.get("targets", []):
            yield f"dashboard: {panel['title']}", target["expr"]
    for variable in board["templating"]["list"]:
        yield "dashboard: variable", variable["query"]["query"]
    (adapter,) = documents(DEPLOY / "prometheus/adapter.yaml")
    for rule in adapter["rules"]["external"]:
        yield "adapter", rule["seriesQuery"]
        yield "adapter", rule["metricsQuery"]


QUERIES = list(queries())


@pytest.mark.parametrize(("where", "query"), QUERIES, ids=[where for where, _ in QUERIES])
def test_a_query_names_what_there_is(where: str, query: str):
    assert query.count("(") == query.count(")"), where
    bare = re.sub(r'"[^"]*"', '""', query)
    names = set(re.findall(r"riposte[a-z0-9_:]*", bare))
    assert names <= EXPORTED | RECORDED, f"{where}: {sorted(names - EXPORTED - RECORDED)}"
    assert names or "up{" in query, where
    for inside in re.findall(r"\{([^}]*)\}", bare):
        labels = set(re.findall(r"(\w+)\s*(?:=~|!~|!=|=)", inside))
        assert labels <= LABELS, f"{where}: {labels - LABELS}"
    for inside in re.findall(r"\b(?:by|without) ?\(([^)]*)\)", bare):
        assert {word.strip() for word in inside.split(",")} <= LABELS, where


def test_counters_and_rates_that_queries_choose_are_counted_somewhere():
    said = {found for _, query in QUERIES for found in re.findall(r'counter="(\w+)"', query)}
    said |= {found for _, query in QUERIES for found in re.findall(r'\brate="(\w+)"', query)}
    assert said
    source = "\n".join(path.read_text() for path in (ROOT / "services").rglob("*.py"))
    for name in said:
        of_the_bus = name.startswith("bus_") and name.removeprefix("bus_") in NAMES
        assert of_the_bus or re.search(rf'"{name}"|\b{name}=0', source), name


def test_the_alert_of_refusals_goes_by_the_routers_counters_and_everybodys():
    (alert,) = (rule for rule in rules() if rule.get("alert") == "RiposteMessagesRefused")
    (chosen,) = re.findall(r'counter=~"([^"]*)"', alert["expr"])
    assert set(chosen.split("|")) == {*REFUSED, "bus_refused_messages"}
    assert "refused_messages" in NAMES


def test_every_alert_says_what_it_is_and_the_runbook_what_to_do():
    runbook = (DEPLOY / "runbook.md").read_text()
    named = re.findall(r"(?m)^### (Riposte\w+)$", runbook)
    alerts = [rule for rule in rules() if "alert" in rule]
    assert named == [rule["alert"] for rule in alerts]
    for rule in alerts:
        assert rule["annotations"]["summary"]
        assert rule["labels"]["severity"] in ("warning", "critical")


def test_the_autoscaler_asks_for_a_metric_that_the_adapter_serves():
    (adapter,) = documents(DEPLOY / "prometheus/adapter.yaml")
    assert [rule["name"]["as"] for rule in adapter["rules"]["external"]] == [
        "riposte_learner_starvation"
    ]


def test_what_is_scraped_is_where_the_endpoint_listens():
    (made,) = documents(DEPLOY / "prometheus/prometheus.yml")
    (job,) = made["scrape_configs"]
    assert job["job_name"] == "riposte"
    assert job["honor_labels"] is True
    assert job["static_configs"] == [{"targets": ["metrics:9464"]}]
    ports = {name: spec["containers"][0].get("ports", []) for name, _, spec in pods()}
    assert ports["riposte-metrics"] == [{"name": "metrics", "containerPort": 9464}]


def test_in_a_cluster_the_endpoint_is_found_by_what_the_manifests_call_it():
    (compose,) = documents(DEPLOY / "prometheus/prometheus.yml")
    (made,) = documents(DEPLOY / "prometheus/kubernetes.yml")
    assert made["rule_files"] == compose["rule_files"]
    (rules_file,) = made["rule_files"]
    assert (DEPLOY / "prometheus" / rules_file.rpartition("/")[2]).is_file()
    (job,) = made["scrape_configs"]
    assert job["job_name"] == "riposte"  # the alerts ask for up{job="riposte"}
    assert job["honor_labels"] is True
    (found,) = job["kubernetes_sd_configs"]
    (overlay,) = documents(DEPLOY / "kubernetes/overlays/small/kustomization.yaml")
    assert found == {"role": "pod", "namespaces": {"names": [overlay["namespace"]]}}
    (rule,) = job["relabel_configs"]
    assert rule["action"] == "keep"
    kept = [
        name
        for name, labels, spec in pods()
        for container in spec["containers"]
        for port in container.get("ports", [])
        if f"{labels['app.kubernetes.io/name']};{port['name']}" == rule["regex"]
    ]
    assert kept == ["riposte-metrics"]


def test_panels_do_not_overlap_and_have_names_of_their_own():
    board = json.loads((DEPLOY / "grafana/dashboards/riposte.json").read_text())
    taken: set[tuple[int, int]] = set()
    for panel in board["panels"]:
        at = panel["gridPos"]
        cells = {(x, y) for x in range(at["x"], at["x"] + at["w"])
                 for y in range(at["y"], at["y"] + at["h"])}  # fmt: skip
        assert not cells & taken, panel["title"]
        assert max(x for x, _ in cells) < 24
        taken |= cells
    assert len({panel["id"] for panel in board["panels"]}) == len(board["panels"])
