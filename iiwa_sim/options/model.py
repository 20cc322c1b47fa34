"""Options of the simulator: types, ranges, units, defaults, help and rules.

`sources.py` derives the command line, environment variables, keys of a fleet file, keyword arguments and the
reference table from it. The field `rate_hz` is the option `--rate`, the variable `IIWA_SIM_RATE`, the key
`rate` of a fleet file and the keyword argument `rate_hz`.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from iiwa_sim.clock import pace
from iiwa_sim.protocols.ports import DEFAULT_PORTS, MAX_PORT
from iiwa_sim.server.token import LOOPBACK, check_token, is_loopback, word_of
from iiwa_sim.server.web_access import WebAccess
from iiwa_sim.wording import Unusable


class SettingError(Unusable, ValueError):
    """An option is unknown, its value is wrong, or it does not fit to others. The message is one line."""


def option_name(field: str) -> str:
    """Return the name of an option: its field without the unit."""
    return field.removesuffix("_hz").removesuffix("_s")


def flag_of(field: str) -> str:
    """Return an option as it is on the command line."""
    return "CELL.toml" if field == "cell" else f"--{option_name(field).replace('_', '-')}"


def file_of(robot: str, file: str) -> str:
    """Return the file that one of several robots writes; a robot without a name writes the file itself."""
    path = Path(file)
    return str(path.parent / f"{path.stem}-{robot}{path.suffix}") if robot else file


def _text(metavar: str, expected: str = "a text", check: Callable[[str], object] = str) -> Meta:
    """Describe a text; `check` raises OSError or ValueError if it is not as `expected`."""
    return Meta(min_length=1, extra={"metavar": metavar, "expected": expected, "check": check})


def _number(metavar: str, least: float, greatest: float, unit: str = "") -> Meta:
    kind = "a whole number" if isinstance(least, int) else "a number"
    expected = f"{kind} from {least:g} to {greatest:g}{unit}"
    return Meta(ge=least, le=greatest, extra={"metavar": metavar, "expected": expected})


_TOKEN = "1 to 256 printable ASCII characters without blanks"
Port = Annotated[int, _number("PORT", 0, MAX_PORT)]
Count = Annotated[int, _number("NUMBER", 1, 10_000)]
Seconds = Annotated[float, _number("SECONDS", 0.001, 86400.0, " s")]
RateHz = Annotated[int, _number("HZ", 1, 1000, " Hz")]
CellFile = Annotated[str, _text("CELL.toml")]
Robot = Annotated[str, _text("NAME|FOLDER")]
File = Annotated[str, _text("FILE")]
Recording = Annotated[str, _text("FILE.mcap")]
Host = Annotated[str, _text("HOST")]
Word = Annotated[str, _text("TOKEN", _TOKEN, check_token)]
TokenFile = Annotated[str, _text("FILE", f"a file with {_TOKEN}", lambda f: check_token(word_of("", f)))]
Clock = Annotated[str, _text("real|10x|fast|stepped", pace.EXPECTED, pace.pace)]
Origin = Annotated[str, _text("ORIGIN", "scheme://host[:port]", lambda text: WebAccess([text]))]
HostName = Annotated[str, _text("NAME", "a bare host name", lambda text: WebAccess(hosts=[text]))]


class Settings(msgspec.Struct, frozen=True, kw_only=True):
    """Options of one robot and of the process that runs it. Raises SettingError if they do not fit together.

    An option has its help, and the first one of a group its title before that. `sources.py` checks types.
    """

    cell: Annotated[CellFile | None, "robots", "robot, start pose, tool, surfaces and parts"] = None
    robot: Annotated[Robot | None, "built-in robot, or a folder; lbr_iiwa_7_r800 if none is given"] = None
    count: Annotated[Count | None, "run equal robots, robot-0, robot-1 and so on; ports count up"] = None
    fleet: Annotated[File | None, "run the robots that this file names"] = None

    protocol: Annotated[
        tuple[Literal["iiwa", "krc4"], ...], "connections", "protocols, each on its own port"
    ] = ("iiwa",)
    host: Annotated[Host, "address to listen on; 0.0.0.0 for all"] = LOOPBACK
    port: Annotated[
        tuple[Port, ...], "a port for each protocol instead of 30000 for iiwa, 54600 for krc4; 0 picks one"
    ] = ()
    strict: Annotated[bool, "reject an iiwa command with surplus values, instead of ignoring them"] = False
    exclusive: Annotated[bool, "serve one client after the other; others wait"] = False
    bye_shuts_down: Annotated[bool, "exit when a client sends bye"] = False

    clock: Annotated[
        Clock,
        "time",
        "real time, a multiple of it, as fast as possible while the robot moves, or advanced by a test only",
    ] = "real"
    rate_hz: Annotated[int, _number("HZ", 100, 1000, " Hz"), "ticks per second"] = 500
    servo_timeout_s: Annotated[
        Seconds | None,
        "stop if no smart or direct move follows the last one within this time",
    ] = None

    status_port: Annotated[Port | None, "output", "port for the state as JSON lines; 0 picks one"] = None
    status_rate_hz: Annotated[int, _number("HZ", 1, 500, " Hz"), "lines per second on the status port"] = 50
    view_port: Annotated[Port | None, "port for a live page; also opens a backdoor; 0 picks one"] = None
    view_host: Annotated[Host, "address of the page; needs a token unless it is loopback"] = LOOPBACK
    view_token: Annotated[Word | None, "admit only browsers that know this token"] = None
    view_token_file: Annotated[TokenFile | None, "file with the token of the page"] = None
    transcript: Annotated[File | None, "write the dialogue, for iiwa-sim replay"] = None
    record: Annotated[Recording | None, "record the run; needs the extra record"] = None
    record_rate_hz: Annotated[RateHz | None, "states per second in the recording, instead of all"] = None
    log_level: Annotated[
        Literal["error", "warning", "info", "debug"],
        "warning adds rejected commands and lost clients, info clients that come and go, debug all commands",
    ] = "warning"
    log_json: Annotated[bool, "log JSON, one object per line"] = False

    backdoor_port: Annotated[
        Port | None, "backdoor", "port for faults, pushes and state as JSON over HTTP; 0 picks one"
    ] = None
    backdoor_host: Annotated[Host, "address of the backdoor; needs a token unless it is loopback"] = LOOPBACK
    backdoor_token: Annotated[
        Word | None, "serve only clients that send this token; other users see it in the list of processes"
    ] = None
    backdoor_token_file: Annotated[TokenFile | None, "file with the token of the backdoor"] = None

    rosbridge_port: Annotated[Port | None, "ROS", "port for rosbridge, usually 9090; 0 picks one"] = None
    rosbridge_origin: Annotated[tuple[Origin, ...], "also admit web pages of this origin"] = ()
    rosbridge_host: Annotated[tuple[HostName, ...], "also admit this name of the machine"] = ()
    ros: Annotated[bool, "run a ROS 1 node at ROS_MASTER_URI; needs rospy"] = False
    ros_result: Annotated[Literal[2016, 2021, 2023, 2024], "year of the message of /command_result"] = 2024
    ros_reference: Annotated[
        Literal["apply", "ignore"], "what to do with a pose_reference_frame other than the base"
    ] = "apply"
    ros_stamps: Annotated[Literal["real", "simulated"], "time in message headers"] = "real"
    ros2: Annotated[bool, "run a ROS 2 node in a process of its own"] = False
    ros2_python: Annotated[
        File | None, "interpreter with rclpy, instead of a sourced one or that of ros2-env"
    ] = None
    ros_namespace: Annotated[str, _text("NAME"), "namespace of the ROS 2 node and its topics"] = ""

    def __post_init__(self) -> None:
        fields = zip(self.__struct_fields__, self.__struct_defaults__, strict=True)
        given = {field for field, default in fields if getattr(self, field) != default}
        needs = [(field, others) for fields, others in NEEDS.items() for field in fields.split()]
        for each, host in (("backdoor", self.backdoor_host), ("view", self.view_host)):
            needs += [] if is_loopback(host) else [(f"{each}_host", f"{each}_token {each}_token_file")]
        for field, others in needs:
            if field in given and not given & set(others.split()):
                flags = " or ".join(map(flag_of, others.split()))
                raise SettingError(f"{flag_of(field)}: expected {flags} with it")
        for field, other in EXCLUDES.items():
            if {field, other} <= given:
                raise SettingError(f"{flag_of(field)}: expected no {flag_of(other)} with it")
        for field in ("status_rate_hz", "record_rate_hz"):
            if field in given and getattr(self, field) > self.rate_hz:
                raise SettingError(f"{flag_of(field)}: expected at most {self.rate_hz} Hz, the --rate")
        if not self.protocol or len(set(self.protocol)) < len(self.protocol):
            raise SettingError("--protocol: expected one or more, each once")
        if self.port not in ((), (0,)) and len(self.port) != len(self.protocol):
            raise SettingError(f"--port: expected {len(self.protocol)}, one for each protocol")

    @property
    def ports(self) -> dict[str, int]:
        """Port of each protocol, 0 for any free one."""
        if self.port == (0,):
            return dict.fromkeys(self.protocol, 0)
        ports = self.port or [DEFAULT_PORTS[protocol] for protocol in self.protocol]
        return dict(zip(self.protocol, ports, strict=True))


PROCESS = {"count", "fleet", "bye_shuts_down", "log_level", "log_json"}
PROCESS |= {"view_port", "view_host", "view_token", "view_token_file"}
"""Options of the process, which one robot of a fleet cannot have."""
WRITTEN = ("transcript", "record")
"""Files of which each robot writes its own."""
FILES = ("cell", "robot", "backdoor_token_file", *WRITTEN)
"""Files whose paths start at the folder of the fleet file."""
PORTS = ("status_port", "rosbridge_port", "backdoor_port")
"""Ports that count up with the robots, besides those of the protocols."""
EXCLUDES = {
    "robot": "cell",
    "fleet": "count",
    "backdoor_token_file": "backdoor_token",
    "view_token_file": "view_token",
}
NEEDS = {
    "status_rate_hz": "status_port",
    "record_rate_hz": "record",
    "rosbridge_origin rosbridge_host": "rosbridge_port",
    "ros2_python ros_namespace": "ros2",
    "ros_result ros_reference ros_stamps": "rosbridge_port ros ros2",
    "backdoor_host backdoor_token backdoor_token_file": "backdoor_port view_port",
    "view_host view_token view_token_file": "view_port",
}
"""Options each of which needs one of the others. Only --help-all lists them."""
