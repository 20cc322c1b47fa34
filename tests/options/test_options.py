"""Options from command line, environment, fleet file and keywords: equal values, one line for a wrong one."""

from __future__ import annotations

from pathlib import Path

import pytest

from iiwa_sim import SettingError, Settings, Simulator
from iiwa_sim.cli.parsing import from_command_line, server
from iiwa_sim.options.model import PROCESS
from iiwa_sim.options.sources import OPTIONS, Place, from_environment, from_names
from tests.processes import refused, robots
from tools.reference import DOCS, PAGES

VALUES = """
cell=cell.toml robot=kr_6_r900_sixx count=3 fleet=fleet.toml protocol=krc4,iiwa host=0.0.0.0 port=31000,31001
strict=true exclusive=TRUE bye_shuts_down=1 clock=fast rate=250 servo_timeout=1.5
status_port=31001 status_rate=20 view_port=31005 view_host=::1 view_token=swordfish view_token_file=SECRET
transcript=said.txt record=run.mcap record_rate=50 log_level=debug log_json=1 backdoor_port=31003
backdoor_host=::1 backdoor_token=swordfish backdoor_token_file=SECRET
rosbridge_port=0 rosbridge_origin=https://a.example,null
rosbridge_host=simulator,robot ros=1 ros_result=2016 ros_reference=ignore ros_stamps=simulated ros2=1
ros2_python=/no/such/python ros_namespace=cell
"""
"""A value other than the default for each option."""


@pytest.fixture
def secret(tmp_path: Path) -> str:
    path = tmp_path / "secret"
    path.write_text("\ufeffswordfish\n", encoding="utf-8")
    return str(path)


def test_an_option_has_the_same_value_from_each_source(secret: str) -> None:
    values = dict(word.replace("SECRET", secret).split("=", 1) for word in VALUES.split())
    options = {option.key: option for option in OPTIONS.values()}
    assert values.keys() == options.keys()
    for key, text in values.items():
        option = options[key]
        words = [option.flag] if option.is_switch else [text] if key == "cell" else [f"{option.flag}={text}"]
        value = from_command_line(words)[option.keyword]
        assert value != option.default
        assert from_environment({option.variable: text})[0][option.keyword] == value
        if option.keyword not in PROCESS:
            native = list(value) if option.is_list else value
            assert from_names({key: native}, Place("key", " = "))[option.keyword] == value
            assert from_names({option.keyword: native}, Place("keyword", "="))[option.keyword] == value


def test_the_command_line_comes_before_the_environment_and_an_empty_variable_is_none() -> None:
    assert robots("--clock", "stepped", IIWA_SIM_CLOCK="fast")[""].clock == "stepped"
    assert robots("a.toml", IIWA_SIM_ROBOT="kr_6_r900_sixx")[""].robot is None
    assert robots(IIWA_SIM_CLOCK="", IIWA_SIM_STRICT="") == robots()
    assert robots(IIWA_SIM_PORT="tcp://10.0.0.7:30000", IIWA_SIM_SERVICE_HOST="10.0.0.7") == robots()


def test_unknown_variables_are_logged_unless_kubernetes_sets_them() -> None:
    variables = {"IIWA_SIM_CLOK": "fast", "IIWA_SIM_PORT_30000_TCP": "tcp://10.0.0.7:30000"}
    assert from_environment(variables) == (
        {},
        ["IIWA_SIM_CLOK: no such option, did you mean IIWA_SIM_CLOCK?"],
    )


WRONG = {
    "--rate 99": "--rate 99: expected a whole number from 100 to 1000 Hz",
    "--port 65536": "--port 65536: expected a whole number from 0 to 65535, commas between",
    "--status-port null": "--status-port null: expected a whole number from 0 to 65535",
    "--servo-timeout 0": "--servo-timeout 0: expected a number from 0.001 to 86400 s",
    "--status-rate 20": "--status-rate: expected --status-port with it",
    "--port 1,2": "--port: expected 1, one for each protocol",
    "--status-port 5 --view-port 5": "--view-port: expected another port than 5, that of --status-port",
    "--count 2 --status-port 30001": "--port for iiwa of robot-1: expected another port than 30001, that of "
    "--status-port of robot-0",
    "--prot 1": "--prot: no such option, did you mean --port?",
    "--cell cell.toml": "--cell: no such option, name the file alone: iiwa-sim CELL.toml",
    "a.toml foo\x1b[2J": r"foo\x1b[2J: unexpected argument",
    "a.toml --robot lbr_iiwa_7_r800": "--robot: expected no CELL.toml with it",
    "chek-cell a.toml": "chek-cell: no file and no command, did you mean check-cell?",
    "shwo": "shwo: no file and no command, did you mean show?",
    "help": "help: no file and no command, did you mean --help?",
    "run": "run: no file and no command",
    "--count 2 --ros": "--ros: expected one robot",
    "--transcript /tmp/a --record /tmp/a": "--transcript, --record: expected a file of its own",
    "--backdoor-port 0 --backdoor-host 0.0.0.0": "--backdoor-host: expected --backdoor-token or "
    "--backdoor-token-file with it",
    "--backdoor-port 0 --backdoor-token schlüssel": "--backdoor-token ***: expected 1 to 256 printable ASCII",
    "--backdoor-port 0 --backdoor-token-file /no/such": "--backdoor-token-file /no/such: expected a file",
    "--rosbridge-port 0 --rosbridge-origin here": "--rosbridge-origin here: expected scheme://host[:port]",
}


def test_a_wrong_command_line_ends_with_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    for words, reason in WRONG.items():
        line = refused(*words.split(" "))
        assert line.startswith(f"iiwa-sim: {reason}"), line
        assert line[:-1].isprintable()
    monkeypatch.setenv("IIWA_SIM_RATE", "99")
    assert refused() == "iiwa-sim: IIWA_SIM_RATE=99: expected a whole number from 100 to 1000 Hz\n"


def test_keywords_and_settings_of_a_simulator() -> None:
    found = Simulator(
        "lbr_iiwa_14_r820", settings=Settings(clock="fast", protocol=("iiwa", "krc4")), rate_hz=250
    )
    assert found.settings == Settings(
        robot="lbr_iiwa_14_r820", clock="fast", protocol=("iiwa", "krc4"), rate_hz=250, port=(0,)
    )
    assert found.clock.tick_s == 0.004
    assert Simulator(cell=found.cell).cell is found.cell


@pytest.mark.parametrize(
    ("keywords", "reason"),
    [
        ({"stirct": True}, "stirct: no such option, did you mean strict?"),
        ({"rate_hz": 5}, "rate_hz=5: expected a whole number from 100 to 1000 Hz"),
        ({"strict": 1}, "strict=1: expected true or false"),
        ({"record_rate_hz": 10}, "--record-rate: expected --record with it"),
        ({"settings": Settings(rate_hz=5)}, "rate_hz=5: expected"),
        ({"log_level": "debug"}, "log_level: expected on the command line"),
    ],
)
def test_wrong_keywords(keywords: dict[str, object], reason: str) -> None:
    with pytest.raises(SettingError, match=reason) as caught:
        Simulator(**keywords)
    assert isinstance(caught.value, ValueError)


def test_the_pages_of_options_and_backdoor_are_current() -> None:
    for name, page in PAGES.items():
        assert (DOCS / f"{name}.md").read_text(encoding="utf-8") == page(), name


def test_a_printed_address_is_accepted() -> None:
    assert from_names({"host": "[::1]"}, Place("keyword", "="))["host"] == "::1"
    assert server("http://[::1]:8080/") == ("::1", [8080])
    assert server("127.0.0.1:30000,54600") == ("127.0.0.1", [30000, 54600])
