"""The backdoor over HTTP, without sockets: each command has its path and does what its line does."""

from __future__ import annotations

import asyncio
import json
from importlib.resources import files

import pytest

from iiwa_sim.backdoor.http import COMMANDS, OF_A_CONNECTION, BackdoorHttp
from iiwa_sim.backdoor.json_lines import fields, reply_in_json
from iiwa_sim.backdoor.recent_dialogue import MOST
from iiwa_sim.protocols.table import ERROR, Request, load_table
from iiwa_sim.server.http import HttpAnswer, HttpRequest
from iiwa_sim.server.token import Token
from iiwa_sim.transcript.lines import Said, read
from tests.backdoor.bench import IIWA, Bench

TABLE = load_table("backdoor", 7)
DIALOGUE = read(
    "backdoor.txt", files("iiwa_sim.protocol").joinpath("transcripts/backdoor/backdoor.txt").read_text()
)
HERE = ("host", "127.0.0.1:30080")


class HttpBench(Bench):
    """A bench with a front of HTTP, too."""

    def __init__(self, robot: str = IIWA, token: str | None = None) -> None:
        super().__init__(robot)
        self.recent.listen()
        known = None if token is None else Token(token)
        self.http = BackdoorHttp(self.backdoor, self.recent, self.journal, known)

    def answer(self, method: str, path: str, body: bytes = b"", *headers: tuple[str, str]) -> HttpAnswer:
        answer = self.http.answer(HttpRequest(method, path, headers or (HERE,), body, "bench"))
        assert isinstance(answer, HttpAnswer)
        return answer

    def posts(self, name: str, /, **values: object) -> tuple[int, object]:
        answer = self.answer("POST", path_of(name), json.dumps(values).encode())
        return answer.status, json.loads(answer.body)


def as_values(request: Request) -> dict[str, object]:
    given = iter(request.values)
    values: dict[str, object] = {
        each.name: next(given) if each.length is None else [next(given) for _ in range(each.length)]
        for each in fields(request.command.parameters)
    }
    return values | dict(zip(request.command.phrases, request.phrases, strict=bool(request.command.phrase)))


def path_of(name: str) -> str:
    return COMMANDS + name.replace(" ", "-")


def test_each_command_of_the_table_has_a_path() -> None:
    bench = HttpBench()
    for name in TABLE.commands:
        if name in OF_A_CONNECTION:
            assert bench.answer("POST", path_of(name)).status == 404
        else:
            assert bench.answer("POST", path_of(name), b'{"no such value": 1}').status == 400, name
            assert bench.answer("GET", path_of(name)).status == 405


async def test_the_transcript_of_lines_gives_the_same_by_http() -> None:
    by_line, by_http = HttpBench(), HttpBench()
    asked = 0
    for line in (each.text for each in DIALOGUE.steps if isinstance(each, Said)):
        request = TABLE.parse(line.encode())
        if not isinstance(request, Request) or request.beyond or request.command.name in OF_A_CONNECTION:
            continue
        if request.command.name in ("advance", "run until stopped"):
            continue
        reply = by_line.tell(line)
        status, answer = by_http.posts(request.command.name, **as_values(request))
        if reply.startswith(f"{ERROR} "):
            _, code, reason = reply.split(" ", 2)
            assert (status, answer) == (409, {"error": {"code": int(code), "reason": reason}}), line
        else:
            assert (status, answer) == (200, {"reply": reply_in_json(request.command, reply)}), line
        assert by_http.seen() == by_line.seen(), line
        asked += 1
    assert asked > 50


def test_what_is_wrong_changes_nothing_and_is_told() -> None:
    bench = HttpBench()
    before = bench.seen()
    assert bench.posts("push", fx=1) == (
        400,
        {
            "error": {
                "code": 3040,
                "reason": "fy: expected it in the object, as push takes fx, fy, fz, tx, ty, tz",
            }
        },
    )
    status, answer = bench.posts("set override", override=2)
    assert (status, answer) == (
        400,
        {"error": {"code": 3040, "reason": "override = 2: expected at least 0 and up to 1"}},
    )
    status, _ = bench.posts("fail move", code=7)
    assert status == 409
    assert bench.answer("POST", "/backdoor/no-such-command").status == 404
    assert bench.answer("GET", "/").status == 404
    assert bench.answer("POST", "/state").status == 405
    assert bench.answer("DELETE", "/backdoor/emergency-stop").headers == (("allow", "POST"),)
    assert bench.seen() == before


def test_a_fault_of_ours_is_told_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = HttpBench()
    monkeypatch.setattr(bench.controller, "emergency_stop", lambda: 1 / 0)
    status, answer = bench.posts("emergency stop")
    assert (status, answer) == (500, {"error": {"code": 3000, "reason": "internal error, see the log"}})


@pytest.mark.parametrize(
    "headers",
    [
        (("host", "rebound.example"),),
        (("host", "rebound.example:30080"),),
        (),
        (HERE, HERE),
        (HERE, ("origin", "http://evil.example")),
        (HERE, ("origin", "http://localhost:3000")),
        (HERE, ("origin", "null")),
    ],
)
@pytest.mark.parametrize("path", ["/backdoor/emergency-stop", "/state", "/healthz"])
def test_web_pages_are_not_let_in(headers: tuple[tuple[str, str], ...], path: str) -> None:
    bench = HttpBench()
    before = bench.seen()
    method = "POST" if path.startswith(COMMANDS) else "GET"
    answer = bench.http.answer(HttpRequest(method, path, headers, b"", "browser"))
    assert isinstance(answer, HttpAnswer)
    assert answer.status == 403
    assert bench.seen() == before


def test_with_a_token_only_who_knows_it_is_let_in_by_any_name() -> None:
    bench = HttpBench(token="swordfish")
    before = bench.seen()
    path = "/backdoor/emergency-stop"
    named = ("host", "robot-0.robots:30080")
    for given in (
        "",
        "swordfish",
        "Basic swordfish",
        "Bearer",
        "Bearer swordfis",
        "Bearer swordfish swordfish",
    ):
        answer = bench.answer("POST", path, b"", named, ("authorization", given))
        assert (answer.status, answer.headers) == (401, (("www-authenticate", "Bearer"),)), given
        assert "swordfish" not in answer.body.decode()
    twice = [("authorization", "Bearer swordfish")] * 2
    assert bench.answer("POST", path, b"", named, *twice).status == 401
    for path_too in ("/state", "/dialogue"):
        assert bench.answer("GET", path_too, b"", named).status == 401
    assert bench.answer("GET", "/healthz", b"", named).status == 200
    assert bench.seen() == before
    page = ("origin", "https://evil.example")
    assert bench.answer("POST", path, b"", named, page, ("authorization", "Bearer swordfish")).status == 403
    assert bench.answer("POST", path, b"", named, ("authorization", "bearer swordfish")).status == 200
    assert bench.seen() != before


def test_the_dialogue_is_that_of_the_drivers() -> None:
    bench = HttpBench()
    for number in range(MOST // 2 + 1):
        bench.dialogue.exchange("driver", f"line {number}", "done")
    answer = json.loads(bench.answer("GET", "/dialogue").body)
    assert answer["forgotten"] == 2
    assert len(answer["lines"]) == MOST
    first, last = answer["lines"][0], answer["lines"][-1]
    assert first == {"time_s": 0.0, "session": "driver", "mark": ">", "text": "line 1"}
    assert last["mark"] == "<"


async def test_who_does_not_wait_ends_what_takes_time() -> None:
    bench = HttpBench()
    bench.clock.start(bench.controller)
    try:
        task = bench.http.answer(
            HttpRequest("POST", "/backdoor/advance", (HERE,), b'{"time": 86400}', "bench")
        )
        assert isinstance(task, asyncio.Task)
        await asyncio.sleep(0)
        task.cancel()
        await asyncio.wait([task])
        assert task.cancelled()
        ended = bench.http.answer(HttpRequest("POST", "/backdoor/advance", (HERE,), b'{"time": 0.01}', "b"))
        assert isinstance(ended, asyncio.Task)
        answer = await ended
        assert (answer.status, json.loads(answer.body)) == (200, {"reply": "done"})
        refused = bench.http.answer(
            HttpRequest("POST", "/backdoor/run-until-stopped", (HERE,), b'{"limit": 1}', "b")
        )
        assert isinstance(refused, asyncio.Task)
        assert json.loads((await refused).body) == {"reply": {"time": 0.0}}
    finally:
        bench.clock.stop()
