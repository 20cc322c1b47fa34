"""What both KRC4 clients send, byte by byte, and what they make of whatever comes."""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
from collections.abc import Callable, Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.client import AsyncKrc4, Krc4, Krc4Error, Krc4Frame, ReplyError
from iiwa_sim.client.messages import LARGEST_INTEGER, SMALLEST_INTEGER, MessageConversation, message, nothing
from iiwa_sim.client.xml_replies import XmlReplies
from iiwa_sim.dialect.krc4.stream import XmlStream
from iiwa_sim.dialect.krc4.table import understand
from tests.client.krc4_peers import asked, assert_closed, replying
from tests.client.peers import Peer, be_impatient
from tests.krc4_talking import FULL, attributes, elements

KINDS = (Krc4, AsyncKrc4)
DEADLINE_S = 30.0
Write = Callable[[str, Mapping[str, object]], bytes]


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
    connect: Callable[..., tuple[Krc4, Peer]], write: Write
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
def test_replies_may_be_cut_anywhere(data: st.DataObject, write: Write) -> None:
    sent = [FULL | {"I0": str(number), "R9": "-1.5e-3"} for number in range(3)]
    wire = b"\n".join(write("Res", each) for each in sent)
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
    write: Write,
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
        (elements("Res", {"I0": 1, "I1": 100}), "the values I0, I1"),
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
        client = open_client(listener.getsockname()[1])
        be_impatient(client)
        peer, _ = listener.accept()
        with peer:
            peer.sendall(said)
            with pytest.raises(TimeoutError, match=r"no answer to DIS within 0\.05 s"):
                client.dis()
            assert_closed(client)


def test_blanks_without_end_are_no_answer(open_client: Callable[..., Krc4]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        client = open_client(listener.getsockname()[1])
        be_impatient(client)
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
