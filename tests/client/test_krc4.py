"""Both KRC4 clients: against a simulator, and against peers that say what a test wants."""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import math
import socket
import struct
import threading
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.client import AsyncKrc4, CommandError, Krc4, Krc4Error, Krc4Frame, ReplyError
from iiwa_sim.client._generated.krc4_numbers import COMMANDS, ERRORS
from iiwa_sim.client.messages import LARGEST_INTEGER, SMALLEST_INTEGER, MessageConversation, message, nothing
from iiwa_sim.client.xml_replies import XmlReplies
from iiwa_sim.dialect.krc4.stream import XmlStream
from iiwa_sim.dialect.krc4.table import load_krc4_table, understand
from iiwa_sim.dialect.wire.error_codes import load_error_codes
from iiwa_sim.simulator import Simulator
from tests.client.peers import Answer, Awaited, Peer
from tools.client_source import krc4 as client_source
from tools.client_source.text import FOLDER

TABLE = {command.tag: command for command in load_krc4_table().commands.values()}
CLIENTS = pytest.mark.parametrize("kind", [Krc4, AsyncKrc4])
HOME_DEG = (0.0, -90.0, 90.0, 0.0, 90.0, 0.0)
NEAR_DEG = (2.0, -90.0, 90.0, 0.0, 90.0, 0.0)
FAR_DEG = (160.0, 40.0, -100.0, 0.0, 90.0, 0.0)
BESIDE = Krc4Frame(445.0, 20.0, 800.0, 180.0, 0.0, 180.0)
IIWA_DEG = (5.0, 30.0, 0.0, -60.0, 0.0, 90.0, 10.0)
FULL = {f"I{place}": "0" for place in range(10)} | {f"R{place}": "0.0" for place in range(10)}
DEADLINE_S = 30.0


@pytest.fixture(params=[Krc4, AsyncKrc4])
def open_client(request: pytest.FixtureRequest) -> Iterator[Callable[..., Krc4]]:
    """Makes a client of either kind, to be called without await."""
    blocking: list[Krc4] = []
    awaited: list[Awaited] = []

    def open_client(port: int, timeout_s: float = 10.0, axes: int = 6) -> Krc4:
        if request.param is Krc4:
            blocking.append(Krc4("127.0.0.1", port, timeout_s, axes=axes))
            return blocking[-1]
        awaited.append(Awaited(lambda: AsyncKrc4("127.0.0.1", port, timeout_s, axes=axes)))
        awaited[-1].reconnect()
        return awaited[-1]

    yield open_client
    for client in blocking:
        client.close()
    for client in awaited:
        client.let_go()


@pytest.fixture
def connect(open_client: Callable[..., Krc4]) -> Iterator[Callable[[Answer], tuple[Krc4, Peer]]]:
    opened: list[tuple[Krc4, Peer]] = []

    def connect(answer: Answer, timeout_s: float = 10.0) -> tuple[Krc4, Peer]:
        peer = Peer(answer)
        opened.append((open_client(peer.port, timeout_s), peer))
        return opened[-1]

    yield connect
    for client, peer in opened:
        client.close()
        peer.close()


@pytest.fixture(scope="module")
def six_axes() -> Iterator[Simulator]:
    with Simulator("kr_6_r900_sixx", dialects=["krc4"], clock="fast") as simulator:
        yield simulator


@pytest.fixture
def robot(six_axes: Simulator, open_client: Callable[..., Krc4]) -> Krc4:
    return open_client(six_axes.port)


def asked(wire: bytes) -> dict[str, str]:
    """A request's values, as another parser reads them."""
    root = ET.fromstring(wire)
    assert root.tag == "Cmd"
    return {child.tag: child.text or "" for child in root}


def elements(values: Mapping[str, object]) -> bytes:
    body = "".join(f"<{name}>{value}</{name}>" for name, value in values.items())
    return f"<Res>{body}</Res>".encode()


def attributes(values: Mapping[str, object]) -> bytes:
    return ET.tostring(ET.Element("Res", {name: str(value) for name, value in values.items()}))


def replying(
    write: Callable[[Mapping[str, object]], bytes] = elements, **values: object
) -> Callable[[bytes], bytes]:
    """Answers each request with its ids and these values."""

    def answer(wire: bytes) -> bytes:
        request = asked(wire)
        return write(FULL | {"I0": request["I0"], "I1": request["I1"]} | values)

    return answer


def assert_closed(client: Krc4) -> None:
    for call in (client.fin, client.goa, client.sto, lambda: client.gio(1)):
        with pytest.raises(ConnectionError, match="this connection is closed"):
            call()
    client.close()


@pytest.mark.parametrize("kind", client_source.KINDS, ids=lambda kind: kind.name)
def test_the_methods_are_what_the_table_makes_of_them(kind: client_source.Kind) -> None:
    written = (FOLDER / kind.file).read_text()
    assert written == client_source.source(kind), "python -m tools.client_source writes it anew"


def test_the_numbers_are_those_of_the_table() -> None:
    assert (FOLDER / client_source.NUMBERS).read_text() == client_source.numbers_source()
    assert {tag: command.id for tag, command in TABLE.items()} == COMMANDS
    assert {code: row.meaning for code, row in load_error_codes().items()} == ERRORS


@CLIENTS
def test_a_method_for_every_message_and_no_other(kind: type) -> None:
    methods = {name for name, _ in inspect.getmembers(kind, inspect.isfunction) if not name.startswith("_")}
    assert methods == {tag.lower() for tag in TABLE} | {"close", "reconnect", "wait_until_stopped"}


def test_each_method_does_what_its_message_says(robot: Krc4) -> None:
    robot.pta(HOME_DEG)
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.gop() == pytest.approx((445, 0, 810, 180, 0, 180), abs=1e-6)
    robot.lin(BESIDE)
    assert robot.gop()[:3] == pytest.approx(BESIDE[:3])
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.fin() is True
    assert robot.dis() == pytest.approx(0.0, abs=1e-6)
    assert robot.gop().y_mm == pytest.approx(BESIDE.y_mm)
    robot.lia(NEAR_DEG)
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.goa() == pytest.approx(NEAR_DEG, abs=1e-6)
    robot.ptp(BESIDE)
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.gop()[:3] == pytest.approx(BESIDE[:3])
    robot.sio(5, True)
    assert robot.gio(5) is True
    robot.sio(5, False)
    assert robot.gio(5) is False
    assert robot.gio(17) is False, "input 1"


def test_a_stop_is_seen_on_the_way(open_client: Callable[..., Krc4]) -> None:
    with Simulator("kr_6_r900_sixx", dialects=["krc4"], clock="stepped") as simulator:
        robot = open_client(simulator.port)
        robot.pta(FAR_DEG)
        simulator.advance(0.2)
        assert robot.fin() is False
        assert robot.dis() > 100
        assert robot.goa() == pytest.approx(FAR_DEG)
        with pytest.raises(TimeoutError, match="still moves"):
            robot.wait_until_stopped(timeout_s=0)
        robot.sto()
        simulator.run_until_stopped()
        robot.wait_until_stopped(timeout_s=0)
        assert robot.goa() != pytest.approx(FAR_DEG, abs=1)


def test_an_iiwa_has_seven_axes(open_client: Callable[..., Krc4]) -> None:
    with Simulator("lbr_iiwa_7_r800", dialects=["krc4"], clock="fast") as simulator:
        robot = open_client(simulator.port, axes=7)
        robot.pta(IIWA_DEG)
        robot.wait_until_stopped(DEADLINE_S)
        assert robot.goa() == pytest.approx(IIWA_DEG)
        frame = robot.gop()
        robot.lin(frame._replace(z_mm=frame.z_mm + 20))
        robot.wait_until_stopped(DEADLINE_S)
        robot.lia(IIWA_DEG)
        robot.wait_until_stopped(DEADLINE_S)
        assert robot.gop() == pytest.approx(frame, abs=1e-6)
        with pytest.raises(ValueError, match="joints_deg: expected 7 numbers, got 6"):
            robot.pta(HOME_DEG)
        narrow = open_client(simulator.port)
        with pytest.raises(ReplyError, match="R6=10"):  # an axis more than it was told
            narrow.goa()
        assert_closed(narrow)


def test_a_refusal_has_its_number_and_the_connection_lives_on(robot: Krc4, six_axes: Simulator) -> None:
    refused = {
        3021: lambda: robot.ptp((9999, 0, 0, 0, 0, 0)),
        3023: lambda: robot.pta((171, *HOME_DEG[1:])),
        1: lambda: robot.gio(99),
        2: lambda: robot.sio(17, True),
        3030: lambda: robot.pta(HOME_DEG),
    }
    for code, call in refused.items():
        if code == 3030:
            six_axes.backdoor.emergency_stop()
        with pytest.raises(Krc4Error, match=f"with error {code}: {ERRORS[code][:20]}") as raised:
            call()
        assert raised.value.code == code
        assert isinstance(raised.value, CommandError)
        assert robot.fin() is True
    six_axes.backdoor.release_emergency_stop()
    six_axes.call(six_axes.controller.reset_error)


def test_closing_stops_the_move(open_client: Callable[..., Krc4]) -> None:
    with Simulator("kr_6_r900_sixx", dialects=["krc4"], clock="stepped") as simulator:
        robot = open_client(simulator.port)
        robot.pta(FAR_DEG)
        robot.close()
        assert_closed(robot)
        robot.reconnect()
        simulator.advance(0.01)
        simulator.run_until_stopped()
        assert robot.fin() is True
        assert robot.goa() != pytest.approx(FAR_DEG, abs=1)


async def test_tasks_may_share_the_async_client() -> None:
    async with (
        Simulator("kr_6_r900_sixx", dialects=["krc4"]) as simulator,
        AsyncKrc4("127.0.0.1", simulator.port) as robot,
    ):
        idle = asyncio.gather(*(robot.fin() for _ in range(20)))
        far = asyncio.gather(*(robot.dis() for _ in range(20)))
        assert await idle == [True] * 20
        assert await far == pytest.approx([0.0] * 20, abs=1e-6)


async def test_a_task_that_is_cancelled_takes_the_connection_with_it() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        async with AsyncKrc4(*silent.getsockname()) as robot:
            task = asyncio.create_task(robot.fin())
            await asyncio.sleep(0)
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task
            with pytest.raises(ConnectionError, match="this connection is closed"):
                await robot.fin()


def test_the_blocking_client_is_a_context_manager() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        with Krc4(*listener.getsockname()) as client:
            peer, _ = listener.accept()
        with peer:
            assert peer.recv(1) == b""
        assert_closed(client)


@CLIENTS
@pytest.mark.parametrize("axes", [0, -1, 11])
def test_a_message_has_room_for_ten_axes(kind: Callable[..., object], axes: int) -> None:
    with pytest.raises(ValueError, match="axes: expected 1 to 10"):
        kind("127.0.0.1", 1, axes=axes)


@pytest.mark.parametrize(
    "call",
    [
        lambda client: client.lin(BESIDE[:5]),
        lambda client: client.ptp((*BESIDE, 0.0)),
        lambda client: client.pta(HOME_DEG[:5]),
        lambda client: client.lia((*HOME_DEG, 0.0)),
        lambda client: client.lin((math.nan, *BESIDE[1:])),
        lambda client: client.pta([math.inf] * 6),
        lambda client: client.sio(2**31, True),
        lambda client: client.gio(-(2**31) - 1),
        lambda client: client.gio(math.nan),
        lambda client: client.gio(1.5),
    ],
)
def test_wrong_numbers_are_never_sent(
    connect: Callable[..., tuple[Krc4, Peer]], call: Callable[[Krc4], object]
) -> None:
    client, peer = connect(replying(I2=1))
    with pytest.raises(ValueError, match="expected"):
        call(client)
    assert client.fin()
    assert peer.heard.count(b"<Cmd>") == 1


def test_a_request_holds_all_twenty_values(connect: Callable[..., tuple[Krc4, Peer]]) -> None:
    client, peer = connect(replying())
    client.sio(3, True)
    assert asked(peer.heard) == FULL | {"I0": "1", "I1": "200", "I2": "3", "I3": "1"}


finite = st.floats(allow_nan=False, allow_infinity=False)


@given(st.lists(finite, max_size=10), st.lists(st.integers(SMALLEST_INTEGER, LARGEST_INTEGER), max_size=8))
def test_the_server_reads_what_was_given(reals: list[float], integers: list[int]) -> None:
    wire = MessageConversation(6).say(message(nothing, "GIO", integers, reals).said)
    stream = XmlStream()
    stream.receive(wire)
    understood = understand(stream.next())
    assert understood.fault == ""
    assert understood.integers == (7, 210, *integers, *[0] * (8 - len(integers)))
    assert struct.pack("10d", *understood.reals) == struct.pack("10d", *reals, *[0.0] * (10 - len(reals)))


def test_ids_count_on_from_one_and_stay_within_32_bit() -> None:
    conversation = MessageConversation()
    request = message(nothing, "FIN").said
    assert [asked(conversation.say(request))["I0"] for _ in range(3)] == ["1", "2", "3"]
    conversation = MessageConversation(LARGEST_INTEGER - 1)
    assert [asked(conversation.say(request))["I0"] for _ in range(3)] == [str(LARGEST_INTEGER), "1", "2"]


@pytest.mark.parametrize("write", [elements, attributes])
def test_values_may_be_elements_or_attributes(
    connect: Callable[..., tuple[Krc4, Peer]], write: Callable[[Mapping[str, object]], bytes]
) -> None:
    client, _ = connect(replying(write, **{f"R{place}": -place / 4 for place in range(6)}))
    assert client.goa() == (0.0, -0.25, -0.5, -0.75, -1.0, -1.25)
    assert client.gop() == Krc4Frame(0.0, -0.25, -0.5, -0.75, -1.0, -1.25)
    assert client.dis() == 0.0


def test_what_stands_between_replies_does_no_harm(connect: Callable[..., tuple[Krc4, Peer]]) -> None:
    reply = replying(I2=1)
    client, _ = connect(lambda wire: b"<?xml version='1.0'?>\n<!-- > -->" + reply(wire) + b"\r\n \t")
    assert [client.fin() for _ in range(3)] == [True] * 3


@given(st.data(), st.sampled_from([elements, attributes]))
def test_replies_may_be_cut_anywhere(
    data: st.DataObject, write: Callable[[Mapping[str, object]], bytes]
) -> None:
    sent = [FULL | {"I0": str(number), "R9": "-1.5e-3"} for number in range(3)]
    wire = b"\n".join(map(write, sent))
    cuts = sorted(data.draw(st.sets(st.integers(1, len(wire) - 1), max_size=8)))
    replies, came = XmlReplies(), []
    for start, end in zip([0, *cuts], [*cuts, len(wire)], strict=True):
        replies.feed(wire[start:end])
        while (values := replies.take()) is not None:
            came.append(values)
    assert came == sent
    assert replies.unread == b""


@pytest.mark.parametrize(
    ("values", "match"),
    [
        ({"I0": 2}, "Res I0=2 I1=100, expected I0=1 I1=100"),
        ({"I0": 0, "I1": 0, "I2": 3040}, "Res I0=0 I1=0 I2=3040, expected I0=1"),
        ({"I1": 310}, "Res I0=1 I1=310, expected"),
        ({"I1": -310}, "Res I0=1 I1=-310, expected"),
        ({"I0": 2, "I1": -100}, "Res I0=2 I1=-100, expected"),
        ({"I2": 2}, "Res I0=1 I1=100 I2=2$"),
        ({"I2": "x"}, "no number"),
        ({"I2": "1.0"}, "no number"),
        ({"I2": "0_1"}, "no number"),
        ({"I2": "\u0661"}, "no number"),
        ({"R0": "1_0"}, "no number"),
        ({"R0": "nan"}, "no number"),
        ({"R0": "1e999"}, "no number"),
        ({"R0": ""}, "no number"),
        ({"R10": "0.0"}, "the values .*, expected"),
    ],
)
@pytest.mark.parametrize("write", [elements, attributes])
def test_a_reply_to_something_else_ends_the_connection(
    connect: Callable[..., tuple[Krc4, Peer]],
    values: dict[str, object],
    match: str,
    write: Callable[[Mapping[str, object]], bytes],
) -> None:
    client, _ = connect(replying(write, **values))
    with pytest.raises(ReplyError, match=f"^FIN was answered.*{match}"):
        client.fin()
    assert_closed(client)


BOMB = b"<!DOCTYPE Res [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;'>]><Res>&b;</Res>"


@pytest.mark.parametrize(
    ("rubbish", "match"),
    [
        (b"stopped\r\n", "no XML"),
        (b"\xff\xfe", "no XML in UTF-8"),
        ("<Res/>".encode("utf-16-le"), "no XML in UTF-8"),
        (b"<Res><I0>1</I1></Res>", "no XML: mismatched tag"),
        (b"<Res><I0>\xff</I0></Res>", "no XML"),
        (b"<Res>&lol;", "no XML: undefined entity"),
        (b"</Res>", "no XML"),
        (b"<!DOCTYPE Res SYSTEM 'file:///etc/passwd'>", "a DTD"),
        (BOMB, "a DTD"),
        (b"<Cmd><I0>1</I0></Cmd>", "'Cmd' in place of 'Res'"),
        (b"<Res><I0><I1>1</I1></I0></Res>", "within the values"),
        (b"<Res><I0 I1='1'>1</I0></Res>", "within the values"),
        (b"<Res>" + b"<I0>" * 1000, "within the values"),
        (b"<Res>1<I0>1</I0></Res>", "text between the values"),
        (b"<Res I0='1'><I0>1</I0></Res>", "'I0' twice"),
        (b"<Res><I0>1</I0><I0>1</I0></Res>", "'I0' twice"),
        (b"<Res I0='" + b">" * 60_000, "more than 100 > in a reply"),
        (b"<Res/>", "the values of none"),
        (elements({"I0": 1, "I1": 100}), "the values I0, I1"),
    ],
)
def test_rubbish_ends_the_connection(
    connect: Callable[..., tuple[Krc4, Peer]], rubbish: bytes, match: str
) -> None:
    client, _ = connect(lambda _: rubbish)
    with pytest.raises(ReplyError, match=f"^FIN was answered with .*{match}"):
        client.fin()
    assert_closed(client)


@pytest.mark.parametrize(
    "reply", [b"", b"<Res>" + b" " * 100_000, b"<Res><I0>" + b"1" * 100_000, b"<!--" + b"x" * 100_000]
)
def test_no_whole_reply_ends_the_connection(connect: Callable[..., tuple[Krc4, Peer]], reply: bytes) -> None:
    client, _ = connect(lambda _: reply)
    with pytest.raises(ConnectionError, match="the connection ended before the answer to FIN"):
        client.fin()
    assert_closed(client)


def test_a_reply_cut_short_by_the_end_of_the_stream(open_client: Callable[..., Krc4]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        client = open_client(listener.getsockname()[1])
        peer, _ = listener.accept()
        with peer:
            peer.sendall(b"<Res><I0>1</I0>")
            peer.shutdown(socket.SHUT_WR)
            with pytest.raises(ConnectionError, match="the connection ended before the answer to FIN"):
                client.fin()
        assert_closed(client)


def test_a_reply_that_nobody_asked_for_ends_the_connection(
    connect: Callable[..., tuple[Krc4, Peer]],
) -> None:
    reply = replying(I2=1)
    client, _ = connect(lambda wire: 2 * reply(wire))
    assert client.fin()
    with pytest.raises(ReplyError, match=r"b'<Res>.*' came unasked, before DIS"):
        client.dis()
    assert_closed(client)


def test_a_number_that_is_not_in_the_table_is_a_refusal_too(
    connect: Callable[..., tuple[Krc4, Peer]],
) -> None:
    client, _ = connect(replying(I1=-25, I2=77))
    with pytest.raises(
        Krc4Error, match=r"the robot refused PTA 1\.0 0\.0 .* with error 77: its log has"
    ) as raised:
        client.pta((1, 0, 0, 0, 0, 0))
    assert raised.value.code == 77
    client.close()


@pytest.mark.parametrize("said", [b"", b"<Res><I0>1</I0>"])
def test_a_robot_that_does_not_answer_times_out(open_client: Callable[..., Krc4], said: bytes) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        client = open_client(listener.getsockname()[1], timeout_s=0.05)
        peer, _ = listener.accept()
        with peer:
            peer.sendall(said)
            with pytest.raises(TimeoutError, match=r"no answer to DIS within 0\.05 s"):
                client.dis()
            assert_closed(client)


def test_blanks_without_end_are_no_answer(open_client: Callable[..., Krc4]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        client = open_client(listener.getsockname()[1], timeout_s=0.05)
        peer, _ = listener.accept()

        def flood() -> None:
            with peer, contextlib.suppress(ConnectionError):
                while True:
                    peer.sendall(b" " * 65536)

        thread = threading.Thread(target=flood, daemon=True)
        thread.start()
        with pytest.raises(TimeoutError, match="no answer to DIS"):
            client.dis()
        assert_closed(client)
        thread.join(DEADLINE_S)
        assert not thread.is_alive()


def test_a_closed_connection_can_be_opened_again(open_client: Callable[..., Krc4]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        client = open_client(listener.getsockname()[1])
        first, _ = listener.accept()
        first.close()
        with pytest.raises(ConnectionError):
            client.fin()
        assert_closed(client)
        client.reconnect()
        second, _ = listener.accept()
        with second:
            answering = threading.Thread(target=lambda: second.sendall(replying(I2=1)(second.recv(4096))))
            answering.start()
            assert client.fin()
            answering.join()
            client.close()


def test_nobody_listens(open_client: Callable[..., Krc4]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(ConnectionRefusedError):
        open_client(port)
