"""Options as environment variables."""

from __future__ import annotations

import argparse
import re

import pytest

from iiwa_sim.cli import main, server_options
from iiwa_sim.cli.environment import unknown_variables, variable
from tests.processes import running

EXAMPLES = {  # of a value other than the default, as text
    "cell": "cell.toml",
    "robot": "kr_6_r900_sixx",
    "host": "0.0.0.0",
    "dialect": "krc4",
    "port": "31000",
    "rate": "250",
    "count": "3",
    "fleet": "fleet.toml",
    "clock": "fast",
    "servo_timeout": "1.5",
    "status_port": "31001",
    "status_rate": "20",
    "rosbridge_port": "31002",
    "rosbridge_secret": "",
    "rosbridge_origin": "https://a.example,https://b.example",
    "rosbridge_host": "simulator,robot",
    "ros": "1",
    "ros_result": "2016",
    "ros_reference": "ignore",
    "ros2": "1",
    "ros2_python": "/no/such/python",
    "ros_namespace": "cell",
    "ros_stamps": "simulated",
    "backdoor_port": "31003",
    "backdoor_http_port": "31004",
    "backdoor_host": "::1",
    "backdoor_token": "swordfish",
    "backdoor_token_file": "",
    "view_port": "31005",
    "view_host": "::1",
    "view_token": "swordfish",
    "view_token_file": "",
    "strict": "true",
    "exclusive": "TRUE",
    "reconnect_pause": "2",
    "transcript": "said.txt",
    "record": "run.mcap",
    "record_rate": "50",
    "bye_shuts_down": "1",
    "log_level": "debug",
    "log_json": "1",
}
NEEDED_WITH = {
    "status_rate": ("--status-port", "0"),
    "record_rate": ("--record", "run.mcap"),
    "rosbridge_secret": ("--rosbridge-port", "0"),
    "rosbridge_origin": ("--rosbridge-port", "0"),
    "rosbridge_host": ("--rosbridge-port", "0"),
    **dict.fromkeys(("ros_result", "ros_reference", "ros_stamps"), ("--rosbridge-port", "0")),
    "ros2_python": ("--ros2",),
    "ros_namespace": ("--ros2",),
    "backdoor_host": ("--backdoor-port", "0"),
    "backdoor_token": ("--backdoor-port", "0"),
    "backdoor_token_file": ("--backdoor-port", "0"),
    "view_host": ("--view-port", "0"),
    "view_token": ("--view-port", "0"),
    "view_token_file": ("--view-port", "0"),
}


def options() -> dict[str, argparse.Action]:
    return {
        option.dest: option
        for option in server_options.server_parser().options
        if variable(option) is not None
    }


def as_arguments(option: argparse.Action, text: str) -> list[str]:
    if not option.option_strings:
        return [text]
    (name,) = option.option_strings
    if option.nargs == 0:
        return [name]
    return [
        f"{name}={each}"
        for each in (text.split(",") if option.dest in ("rosbridge_origin", "rosbridge_host") else [text])
    ]


def test_each_option_has_an_example_here() -> None:
    assert set(options()) == set(EXAMPLES)


def test_a_wrong_value_ends_with_one_line_that_names_the_variable(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("IIWA_SIM_RATE", "99")
    with pytest.raises(SystemExit) as caught:
        main([])
    out, err = capsys.readouterr()
    assert (caught.value.code, out) == (2, "")
    assert re.fullmatch(r"iiwa-sim: IIWA_SIM_RATE: [^\n]+\n", err)


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_variable_does_what_the_option_does(name: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    option, text = options()[name], EXAMPLES[name]
    if name in ("rosbridge_secret", "backdoor_token_file", "view_token_file"):
        secret = tmp_path_factory.mktemp("secret") / "secret"
        secret.write_text("swordfish")
        text = str(secret)
    besides = NEEDED_WITH.get(name, ())
    by_variable = server_options.parsed(besides, {f"IIWA_SIM_{name.upper()}": text})
    assert vars(by_variable) == vars(server_options.parsed([*besides, *as_arguments(option, text)], {}))
    assert vars(by_variable) != vars(server_options.parsed(besides, {}))


def test_the_command_line_comes_before_the_environment() -> None:
    assert server_options.parsed(["--clock", "stepped"], {"IIWA_SIM_CLOCK": "fast"}).clock.name == "stepped"


def test_an_empty_variable_is_none() -> None:
    assert vars(server_options.parsed([], {"IIWA_SIM_CLOCK": "", "IIWA_SIM_STRICT": ""})) == vars(
        server_options.parsed([], {})
    )


def test_what_kubernetes_sets_for_a_service_of_this_name_is_left_alone() -> None:
    links = {"IIWA_SIM_PORT": "tcp://10.0.0.7:30000", "IIWA_SIM_SERVICE_HOST": "10.0.0.7"}
    assert vars(server_options.parsed([], links)) == vars(server_options.parsed([], {}))
    assert (
        unknown_variables(
            server_options.server_parser(), links | {"IIWA_SIM_PORT_30000_TCP": "tcp://10.0.0.7:30000"}
        )
        == []
    )


def test_help_is_told_whatever_the_environment_says(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("IIWA_SIM_RATE", "none")
    with pytest.raises(SystemExit) as caught:
        main(["--help"])
    assert caught.value.code == 0
    assert "IIWA_SIM_CLOCK=fast" in capsys.readouterr().out


def test_a_process_takes_its_variables_and_tells_one_that_is_no_option(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("IIWA_SIM_CLOK", "fast")
    monkeypatch.setenv("IIWA_SIM_DIALECT", "krc4")
    with running() as simulator:
        code, said = simulator.ends(15)
    assert code == 0
    assert "the environment variable IIWA_SIM_CLOK is no option of iiwa-sim" in said
