"""Kubernetes' manifests: its schema, names that meet, and as few rights as possible."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import kubernetes_validate
import pytest
import yaml

from shared.messages.topics import CERTIFIED
from tests.unit.deploy.found import (
    KUBERNETES,
    OWN_IMAGES,
    ROOT,
    code_blocks,
    documents,
    manifests,
    pods,
)

VERSION = "1.32"
KUSTOMIZATIONS = sorted(KUBERNETES.parent.rglob("kustomization.yaml"))
OVERLAYS = sorted(path for path in (KUBERNETES / "overlays").iterdir() if path.is_dir())
ALL = list(manifests())
DEPLOY_PAGE = ROOT / "docs/deploy.md"


@pytest.mark.parametrize(
    "document",
    [made for _, made in ALL],
    ids=[f"{m['kind']}-{m['metadata']['name']}" for _, m in ALL],
)
def test_a_manifest_is_what_kubernetes_expects(document: dict[str, Any]):
    kubernetes_validate.validate(document, VERSION, strict=True)


def test_whoever_deletes_the_job_keeps_its_volumes():
    """With its namespace every claim in it would go."""
    for path in KUSTOMIZATIONS:
        assert not [name for name in documents(path)[0].get("resources", []) if "namespace" in name]
    assert "kubectl apply -f deploy/kubernetes/namespace.yaml" in code_blocks(DEPLOY_PAGE)


def test_another_run_has_other_folders():
    for name, _, spec in pods():
        for container in spec["containers"]:
            words = container.get("args", [])
            if "--run" in words and "--run-id" in words:
                folder, run = (words[words.index(word) + 1] for word in ("--run", "--run-id"))
                assert folder.startswith("/tmp/") or folder.endswith(f"/{run}"), name


def test_a_misspelt_field_is_noticed():
    (document, *_) = (made for _, made in ALL if made["kind"] == "PodDisruptionBudget")
    wrong = {**document, "spec": {**document["spec"], "maxUnavailible": 1}}
    with pytest.raises(kubernetes_validate.ValidationError):
        kubernetes_validate.validate(wrong, VERSION, strict=True)


@pytest.mark.parametrize("path", KUSTOMIZATIONS, ids=lambda path: path.parent.name)
def test_everything_that_a_kustomization_names_is_there_and_nothing_is_left_over(path: Path):
    (made,) = documents(path)
    named = list(made.get("resources", []))
    for generator in made.get("configMapGenerator", []):
        named += [entry.rpartition("=")[2] for entry in generator.get("files", [])]
    for name in named:
        where = path.parent / name
        assert where.is_file() or (where / "kustomization.yaml").is_file(), f"{path}: {name}"
    present = {file.name for file in path.parent.glob("*.yaml")} - {path.name}
    assert present <= set(named), f"{path} does not use {present - set(named)}"


def render(folder: Path) -> list[Any]:
    """What would be sent to a cluster."""
    for command in (("kubectl", "kustomize"), ("kustomize", "build")):
        if shutil.which(command[0]):
            done = subprocess.run(
                [*command, str(folder)], capture_output=True, text=True, timeout=60, check=False
            )
            assert done.returncode == 0, done.stderr
            return [made for made in yaml.safe_load_all(done.stdout) if made]
    pytest.skip("needs kubectl or kustomize to render")


@pytest.mark.parametrize("folder", OVERLAYS, ids=lambda path: path.name)
def test_an_overlay_renders_to_what_kubernetes_expects(folder: Path):
    made = render(folder)
    names = {(one["kind"], one["metadata"]["name"]) for one in made}
    for one in made:
        kubernetes_validate.validate(one, VERSION, strict=True)
        if one["kind"] not in ("Namespace",):
            assert one["metadata"]["namespace"] == "riposte", one["metadata"]["name"]
        if one["kind"] in ("StatefulSet", "Deployment"):
            spec = one["spec"]["template"]["spec"]
            for container in spec["containers"]:
                tag = container["image"].rpartition("/")[2].partition(":")[2]
                assert tag not in ("", "latest"), container["image"]
            for volume in spec["volumes"]:
                if (config := volume.get("configMap")) is not None:
                    assert ("ConfigMap", config["name"]) in names, config["name"]
    scalers = [one for one in made if one["kind"] == "HorizontalPodAutoscaler"]
    for scaler in scalers:
        target = scaler["spec"]["scaleTargetRef"]
        assert (target["kind"], target["name"]) in names


def test_no_image_is_whatever_was_pushed_last():
    """An image without a tag is ``latest``, and Kubernetes asks a registry for it every time."""
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    for folder in OVERLAYS:
        (made,) = documents(folder / "kustomization.yaml")
        tags = {image["name"]: image["newTag"] for image in made["images"]}
        for name, _, spec in pods():
            for container in spec["containers"]:
                image, _, tag = container["image"].partition(":")
                tag = tags.get(image, tag)
                assert tag not in ("", "latest"), f"{folder.name}: {name}: {container['image']}"
                assert image not in OWN_IMAGES or tag == version, f"{folder.name}: {name}: {tag}"
    built = re.findall(r"(?m)^docker build .*--target \w+ -t (\S+)", code_blocks(DEPLOY_PAGE))
    assert built == [f"{name}:{version}" for name in OWN_IMAGES]


def test_selectors_select_somebody():
    labels = [labels for _, labels, _ in pods()]
    for path, document in ALL:
        spec = document.get("spec", {})
        wanted = spec.get("selector") if document["kind"] == "Service" else None
        if document["kind"] == "NetworkPolicy":
            wanted = spec["podSelector"].get("matchLabels", {})
        if document["kind"] in ("PodDisruptionBudget", "StatefulSet", "Deployment"):
            wanted = spec["selector"]["matchLabels"]
        if wanted is not None:
            found = [one for one in labels if wanted.items() <= one.items()]
            assert found, f"{path.name}: nobody has {wanted}"


def test_every_pod_runs_with_as_few_rights_as_it_can():
    seen = 0
    for name, _, spec in pods():
        seen += 1
        own = spec["securityContext"]
        assert own["runAsNonRoot"] is True, name
        assert own["seccompProfile"] == {"type": "RuntimeDefault"}, name
        assert spec["automountServiceAccountToken"] is False, name
        volumes = {volume["name"] for volume in spec["volumes"]}
        for container in spec["containers"]:
            context = container["securityContext"]
            assert context["allowPrivilegeEscalation"] is False, name
            assert context["readOnlyRootFilesystem"] is True, name
            assert context["capabilities"] == {"drop": ["ALL"]}, name
            assert {"cpu", "memory"} <= container["resources"]["requests"].keys(), name
            assert "memory" in container["resources"]["limits"], name
            assert "livenessProbe" in container, name
            mounts = {mount["name"] for mount in container["volumeMounts"]}
            assert mounts - {"data"} <= volumes, name
            for probe in ("startupProbe", "livenessProbe"):
                if "exec" in container.get(probe, {}):
                    command = container[probe]["exec"]["command"]
                    assert command[0] == "riposte-alive", name
                    assert float(command[2]) > 1.0, name
                    places = {mount["mountPath"] for mount in container["volumeMounts"]}
                    assert command[1] in places, name
    assert seen == 6


def test_nothing_is_let_in_or_out_unless_a_policy_says_so():
    policies = {m["metadata"]["name"]: m["spec"] for _, m in ALL if m["kind"] == "NetworkPolicy"}
    assert policies["default-deny"] == {"podSelector": {}, "policyTypes": ["Ingress", "Egress"]}
    on_the_bus = {name for name, labels, _ in pods() if labels.get("riposte.io/bus") == "client"}
    ours = {name for name, _, spec in pods() if spec["containers"][0]["image"] in OWN_IMAGES}
    assert on_the_bus == ours


def test_the_autoscaler_goes_by_starvation_and_leaves_the_number_to_nobody_else():
    (scaler,) = (m["spec"] for _, m in ALL if m["kind"] == "HorizontalPodAutoscaler")
    (metric,) = scaler["metrics"]
    assert metric["external"]["metric"]["name"] == "riposte_learner_starvation"
    assert scaler["behavior"]["scaleUp"]["stabilizationWindowSeconds"] == 30
    assert scaler["behavior"]["scaleDown"]["stabilizationWindowSeconds"] == 300
    (actors,) = (m for _, m in ALL if m["metadata"]["name"] == "riposte-actor"
                 and m["kind"] == "Deployment")  # fmt: skip
    assert "replicas" not in actors["spec"]


def test_the_script_makes_the_secrets_that_the_pods_ask_for():
    script = (KUBERNETES / "secrets.sh").read_text()
    (line,) = re.findall(r"(?m)^for role in (.*); do$", script)
    asked = {
        volume["secret"]["secretName"].removeprefix("riposte-certificates-")
        for _, _, spec in pods()
        for volume in spec["volumes"]
        if "secret" in volume
    }
    assert set(line.split()) == asked
    assert asked <= set(CERTIFIED)
