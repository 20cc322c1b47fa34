"""The manifests, put together by kustomize and held against the published schemas, without a cluster."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from iiwa_sim.cli import server_options
from iiwa_sim.cli.environment import unknown_variables

FOLDER = Path(__file__).parent.parent.parent / "examples" / "kubernetes"
BIN = Path(sys.executable).parent
VERSIONS = ("1.30", "1.37")


def built(folder: Path) -> str:
    done = subprocess.run(
        [str(BIN / "kubectl"), "kustomize", str(folder)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def faults(text: str, version: str, folder: Path) -> str:
    file = folder / "built.yaml"
    file.write_text(text)
    words = [str(BIN / "kubernetes-validate"), "--strict", "-k", version, str(file)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)
    return "" if done.returncode == 0 else done.stdout + done.stderr


@pytest.fixture(scope="module")
def manifests() -> list[dict[str, Any]]:
    return list(yaml.safe_load_all(built(FOLDER)))


@pytest.mark.parametrize("version", [pytest.param(VERSIONS[0], marks=pytest.mark.slow), VERSIONS[1]])
def test_they_are_of_the_published_schemas(version: str, tmp_path: Path) -> None:
    text = built(FOLDER)
    assert faults(text, version, tmp_path) == ""
    assert "serviceNam" in faults(text.replace("serviceName:", "serviceNam:"), version, tmp_path)


def test_each_robot_has_a_name_of_its_own(manifests: list[dict[str, Any]]) -> None:
    kinds = {each["kind"]: each for each in manifests}
    service, stateful = kinds["Service"], kinds["StatefulSet"]
    assert service["spec"]["clusterIP"] == "None"
    assert stateful["spec"]["serviceName"] == service["metadata"]["name"]
    assert stateful["spec"]["replicas"] == 5
    labels = stateful["spec"]["template"]["metadata"]["labels"]
    assert service["spec"]["selector"].items() <= labels.items()
    assert stateful["spec"]["selector"]["matchLabels"].items() <= labels.items()
    assert service["metadata"]["name"] != "iiwa-sim"  # or its variables would look like options


def test_the_container_is_one_that_this_image_makes(manifests: list[dict[str, Any]]) -> None:
    (stateful,) = (each for each in manifests if each["kind"] == "StatefulSet")
    (container,) = stateful["spec"]["template"]["spec"]["containers"]
    environment = {each["name"]: each["value"] for each in container["env"]}
    assert unknown_variables(server_options.server_parser(), environment) == []
    options = server_options.parsed([], environment)
    (port,) = container["ports"]
    assert options.port == [port["containerPort"]]
    assert container["livenessProbe"]["exec"]["command"] == ["iiwa-sim", "health"]
    assert container["readinessProbe"]["tcpSocket"]["port"] == port["name"]
    assert container["securityContext"]["readOnlyRootFilesystem"]


def test_another_size_and_image_are_an_overlay(tmp_path: Path) -> None:
    shutil.copytree(FOLDER, tmp_path / "base")
    (tmp_path / "kustomization.yaml").write_text(
        "resources: [base]\nnamePrefix: left-\nreplicas: [{name: iiwa-sim, count: 50}]\n"
        "images: [{name: iiwa-sim, newName: registry.example/iiwa-sim, digest: 'sha256:" + "0" * 64 + "'}]\n"
    )
    stateful = next(each for each in yaml.safe_load_all(built(tmp_path)) if each["kind"] == "StatefulSet")
    assert stateful["spec"]["replicas"] == 50
    assert stateful["spec"]["serviceName"] == "left-robots"
    (container,) = stateful["spec"]["template"]["spec"]["containers"]
    assert container["image"] == f"registry.example/iiwa-sim@sha256:{'0' * 64}"
