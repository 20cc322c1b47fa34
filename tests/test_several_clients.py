"""Several clients of one robot, over real sockets: all at once, or one after the other."""

from __future__ import annotations

import pytest

from iiwa_sim.client import Iiwa
from tests import drivers
from tests.drivers import ONE_OF_EACH_PROTOCOL, SCENES
from tests.line_client import DEADLINE_S, until
from tests.processes import running


def test_a_bye_ends_the_process_with_bye_shuts_down() -> None:
    with running("--bye-shuts-down", "--status-port", "0") as simulator:
        with Iiwa("127.0.0.1", simulator.port) as early:
            early.hello()
        with Iiwa("127.0.0.1", simulator.port) as robot:
            robot.joint_move((1, 1, 1, -1.5, 1, 1, 1), (0.1,) * 7)
            robot.bye()
            _, errors = simulator.process.communicate(timeout=DEADLINE_S)
        assert (simulator.process.returncode, errors) == (0, "")


@pytest.mark.parametrize("name", ONE_OF_EACH_PROTOCOL)
async def test_exclusive_serves_one_client_at_a_time_in_all_protocols(name: str) -> None:
    scene = SCENES[name]
    async with scene.simulator(exclusive=True) as simulator:
        first, _ = await drivers.connect(simulator, scene.spoken)
        second, _ = await drivers.connect(simulator, scene.other)
        third, _ = await drivers.connect(simulator, scene.spoken)
        for each in (second, third):
            each.send(b"".join(each.QUESTIONS))
            await each.sent()
        simulator.backdoor.set_override(0.2)
        simulator.backdoor.clear_faults()  # admits no client
        assert await first.moves(scene.far) == 0
        await until(lambda: simulator.joints != simulator.cell.start)
        assert second.unread == third.unread == b""
        await first.leaves()
        await until(lambda: second.unread != b"")
        await second.whole_reply()  # whether the robot still brakes is up to the machine
        await second.whole_reply()
        await second.whole_reply()
        await second.until_stopped()
        assert third.unread == b"", "one at a time"
        assert simulator.joints != pytest.approx(scene.far, abs=0.1)
        await second.leaves()
        assert [await third.whole_reply() for _ in range(3)] == list(third.ANSWERS)
        await third.leaves()
