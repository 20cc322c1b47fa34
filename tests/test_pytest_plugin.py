"""The fixture `iiwa` in a project without a conftest, in a process of its own where that matters."""

from __future__ import annotations

import re
import textwrap

import pytest

import iiwa_sim.simulator  # noqa: F401  # pytest within this process then drops no part of it at its end

TALK = '''
import asyncio, os, socket, threading
import pytest

class Driver:
    """One command, one reply."""
    def __init__(self, host, port):
        self._socket = socket.create_connection((host, port), timeout=60)
        self._file = self._socket.makefile("rw", newline="")
    def ask(self, command):
        self._file.write(command + "\\r\\n")
        self._file.flush()
        return self._file.readline().strip()
    def move(self, command):
        assert self.ask(command) == "done"
        while self.ask("get status") == "moving":
            pass
    def close(self):
        self._file.close()
        self._socket.close()

@pytest.fixture
def driver(iiwa):
    driver = Driver(iiwa.host, iiwa.port)
    yield driver
    driver.close()

FAR = "joint move : 1 1 1 -1.5 1 1 1 " + "0.06 " * 7
'''


class Project:
    """A driver's project."""

    def __init__(self, pytester: pytest.Pytester) -> None:
        self._pytester = pytester

    def tests(self, code: str, *options: str, process: bool = False) -> pytest.RunResult:
        """Run tests, on request in a process of their own, which costs some ten times as much."""
        self._pytester.makepyfile(TALK + textwrap.dedent(code))
        if process:
            # hypothesis takes longer to load than all else
            plain = ("-W", "error", "-p", "no:hypothesispytest")
            return self._pytester.runpytest_subprocess(*plain, *options, timeout=120)
        return self._pytester.runpytest_inprocess("-W", "error", *options)


@pytest.fixture
def project(pytester: pytest.Pytester) -> Project:
    # pytest-asyncio warns where this is not set
    pytester.makeini("[pytest]\nasyncio_default_fixture_loop_scope = function\n")
    return Project(pytester)


@pytest.mark.requirement("FRA005")
def test_every_test_gets_a_fresh_robot_and_leaves_nothing_behind(project: Project) -> None:
    result = project.tests(
        """
        import gc, weakref

        def left():
            return threading.active_count(), sorted(os.listdir("/proc/self/fd"))

        seen = []
        robots = weakref.WeakSet()

        def test_first(iiwa, driver):
            robots.add(iiwa)
            driver.move(FAR)
            assert driver.ask("get joint position").startswith("1.0 1.0 1.0")

        def test_second(driver):
            assert driver.ask("get joint position").startswith("0.0 0.52")

        def test_ended(pytestconfig):
            seen.append(left())

        @pytest.mark.parametrize("number", range(4))
        def test_many(iiwa, number):
            robots.add(iiwa)
            if number % 3 == 0:  # some driver that is not closed, and its robot still moves
                driver = Driver(iiwa.host, iiwa.port)
                assert driver.ask(FAR) == "done"
                driver.close()

        def test_nothing_is_left():
            assert left() == seen[0]
            gc.collect()
            assert not robots
        """,
        "-p",
        "no:xdist",
        process=True,
    )
    result.assert_outcomes(passed=8)


def test_plain_and_async_tests(project: Project) -> None:
    result = project.tests(
        """
        def test_plain(iiwa, driver):
            driver.move(FAR)
            assert iiwa.joints == (1.0, 1.0, 1.0, -1.5, 1.0, 1.0, 1.0)

        @pytest.mark.asyncio
        async def test_async(iiwa):
            reader, writer = await asyncio.open_connection(iiwa.host, iiwa.port)
            writer.write(b"hello\\r\\n")
            assert await reader.readline() == b"hello\\r\\n"
            writer.close()
            await writer.wait_closed()
            iiwa.advance(1.0)
        """,
        "-o",
        "asyncio_mode=auto",
    )
    result.assert_outcomes(passed=2)


@pytest.mark.parametrize(
    "options", [pytest.param((), id="plain"), pytest.param(("-n", "1"), id="xdist", marks=pytest.mark.slow)]
)
def test_a_failed_test_shows_the_dialogue_and_the_last_state(
    project: Project, options: tuple[str, ...]
) -> None:
    result = project.tests(
        """
        def test_fails(iiwa, driver):
            driver.move(FAR)
            for _ in range(5):
                driver.ask("get mode")
            iiwa.call(iiwa.controller.emergency_stop)
            assert driver.ask(FAR) == "done"

        def test_passes(driver):
            assert driver.ask("help : stop")
        """,
        *options,
        process=bool(options),
    )
    result.assert_outcomes(failed=1, passed=1)
    result.stdout.re_match_lines(
        [
            "-+ iiwa dialogue -+",
            "simulated +real",
            r" +0\.\d{3} +\d+\.\d{3}  127\.0\.0\.1:\d+ # connected",
            r" +0\.\d{3} +\d+\.\d{3}  127\.0\.0\.1:\d+ > joint move : 1 1 1 .*",
            " +< done",
            r" +\d+\.\d{3} +\d+\.\d{3}  127\.0\.0\.1:\d+ > get status",
            " +< stopped",
            r" +9\.\d{3} +\d+\.\d{3}  127\.0\.0\.1:\d+ > get mode",
            r" +< normal  \(5 times\)",
            r".* > joint move : 1 1 1 .*",
            " +< error",
            "-+ iiwa state -+",
            "status: stopped",
            r"joint_position: \(1.0, 1.0, 1.0, -1.5, 1.0, 1.0, 1.0\)",
            "error: .*3030.*emergency stop.*",
        ]
    )
    result.stdout.no_fnmatch_line("*help : stop*")


def test_a_failed_call_is_shown_at_the_line_of_the_test(project: Project) -> None:
    result = project.tests(
        """
        from iiwa_sim import Iiwa

        @pytest.mark.iiwa(clock="stepped")
        def test_still_moving(iiwa, driver):
            driver.ask(FAR)
            iiwa.run_until_stopped(0.01)

        def test_wrong_call(iiwa):
            iiwa.backdoor.set_clock("warp")

        def test_command_error(iiwa):
            with Iiwa(iiwa.host, iiwa.port) as robot:
                robot.lin_move((4500, 0, 0, 0, 0, 0), speed=0.5, blending=0)
        """
    )
    result.assert_outcomes(failed=3)
    assert {"iiwa_sim" in line for line in result.outlines if re.match(r"\S+\.py:\d+:", line)} == {False}


def test_options_come_from_marker_command_line_and_ini(project: Project, pytester: pytest.Pytester) -> None:
    pytester.makeini(
        """
        [pytest]
        asyncio_default_fixture_loop_scope = function
        iiwa_robot = lbr_iiwa_14_r820
        iiwa_clock = stepped
        iiwa_rate = 250
        """
    )
    result = project.tests(
        """
        def of(iiwa):
            return (iiwa.cell.description.name, iiwa.clock.pace.name, iiwa.clock.tick_s)

        def test_command_line_over_ini(iiwa):
            assert of(iiwa) == ("LBR iiwa 14 R820", "10x", 0.004)

        @pytest.mark.iiwa(clock="real", rate_hz=1000)
        class TestMarked:
            def test_marker_over_command_line(self, iiwa):
                assert of(iiwa) == ("LBR iiwa 14 R820", "real", 0.001)

            @pytest.mark.iiwa(robot="lbr_iiwa_7_r800", clock="fast")
            def test_the_nearest_marker_holds(self, iiwa):
                assert of(iiwa) == ("LBR iiwa 7 R800", "fast", 0.001)
        """,
        "--strict-markers",
        "--iiwa-clock",
        "10x",
    )
    result.assert_outcomes(passed=3)


WRONG = {
    "clok='fast'": "fixture iiwa: clok: no such option, did you mean clock?",
    "robot='kr_6_r900_sixx'": "fixture iiwa: *expected 7 joints for protocol iiwa; for 6 there is: --prot*",
    "clock='fats'": "fixture iiwa: clock='fats': expected real, a multiple *",
}


def test_a_wrong_marker_is_reported_in_one_line(project: Project) -> None:
    result = project.tests(
        "\n".join(
            f"@pytest.mark.iiwa({arguments})\ndef test_wrong_{number}(iiwa):\n    pass\n"
            for number, arguments in enumerate(WRONG)
        )
    )
    result.assert_outcomes(errors=len(WRONG))
    result.stdout.fnmatch_lines(list(WRONG.values()))
    result.stdout.no_fnmatch_line("*Traceback*")
    result.stdout.no_fnmatch_line("*During handling*")


def test_the_unused_plugin_loads_nothing(project: Project, pytester: pytest.Pytester) -> None:
    pytester.makeconftest(
        """
        import sys

        def pytest_unconfigure():
            ours = [name for name in sys.modules if name.split(".")[0] in ("iiwa_sim", "pinocchio", "ruckig")]
            print("loaded:", *sorted(ours))
        """
    )
    result = project.tests("def test_nothing():\n    pass\n", "-s", process=True)
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["loaded: iiwa_sim iiwa_sim.pytest_plugin iiwa_sim.wording"])
    result.stdout.no_fnmatch_line("*iiwa dialogue*")


def test_a_test_reads_the_dialogue_and_sets_canned_replies(project: Project) -> None:
    result = project.tests(
        """
        def test_said(iiwa, driver):
            driver.ask("hello")
            driver.move(FAR)
            assert iiwa.dialogue.commands()[:2] == ["hello", "joint move"]
            iiwa.dialogue.assert_said("joint move", times=1)
            iiwa.dialogue.assert_said(FAR)
            iiwa.dialogue.assert_said("stop", times=0)

        def test_not_said(iiwa, driver):
            driver.ask("hello")
            iiwa.dialogue.assert_said("stop")

        @pytest.mark.iiwa(clock="stepped", protocol=["krc4", "iiwa"])
        def test_canned(iiwa):
            driver = Driver(iiwa.host, iiwa.ports["iiwa"])
            iiwa.reply("get status", "moving", times=2)
            iiwa.reply("joint move", "error")
            assert [driver.ask("get status") for _ in range(3)] == ["moving", "moving", "stopped"]
            assert [driver.ask(FAR), driver.ask("get status"), driver.ask("get error")] == [
                "error", "stopped", "0 none"
            ]
            iiwa.reply("hello", "HELLO", times=0)
            assert driver.ask("hello") + driver.ask("hello") == "HELLOHELLO"
            iiwa.backdoor.clear_faults()
            assert driver.ask("hello") == "hello"
            driver.close()

        @pytest.mark.iiwa(protocol=["krc4"])
        def test_not_in_krc4(iiwa):
            with pytest.raises(ValueError, match="expected a robot that speaks iiwa"):
                iiwa.reply("hello", "hello")
        """
    )
    result.assert_outcomes(passed=3, failed=1)
    result.stdout.fnmatch_lines(["*expected 'stop' at least once, was said 0 times; commands: hello*"])


def test_a_test_has_as_many_robots_as_it_requests(project: Project, pytester: pytest.Pytester) -> None:
    pytester.makefile(".toml", twelve='robot = "lbr_iiwa_14_r820"')
    result = project.tests(
        """
        def name(robot):
            return robot.cell.description.name

        def ask(robot, command):
            driver = Driver(robot.host, robot.port)
            try:
                return driver.ask(command)
            finally:
                driver.close()

        @pytest.mark.iiwa(rate_hz=250)
        def test_three(iiwa, iiwa_factory):
            left, right = iiwa_factory(cell="twelve.toml"), iiwa_factory(robot="lbr_iiwa_7_r800")
            assert [name(each) for each in (iiwa, left, right)] == [
                "LBR iiwa 7 R800", "LBR iiwa 14 R820", "LBR iiwa 7 R800"
            ]
            assert left.clock.tick_s == right.clock.tick_s == 0.004
            assert len({iiwa.port, left.port, right.port}) == 3
            for each in (left, right):
                assert ask(each, "hello") == "hello"
            left.dialogue.assert_said("hello", times=1)

        def test_none_is_left():
            assert "iiwa-sim" not in [each.name for each in threading.enumerate()]

        def test_wrong(iiwa_factory):
            iiwa_factory(robt="lbr_iiwa_7_r800")

        def test_failed(iiwa_factory):
            iiwa_factory()
            ask(iiwa_factory(), "get mode")
            raise AssertionError("on purpose")
        """
    )
    result.assert_outcomes(passed=2, failed=2)
    result.stdout.fnmatch_lines(["fixture iiwa: robt: no such option, did you mean robot?"])
    result.stdout.fnmatch_lines(
        ["*iiwa_factory 1 dialogue*", "nothing was said", "*iiwa_factory 2 dialogue*", "*> get mode"]
    )


def test_tests_may_share_a_robot(project: Project) -> None:
    result = project.tests(
        """
        @pytest.fixture
        def robot(iiwa_session):
            yield iiwa_session
            iiwa_session.call(iiwa_session.controller.stop)
            iiwa_session.run_until_stopped()
            iiwa_session.backdoor.clear_faults()
            iiwa_session.backdoor.restore_state("start")
            iiwa_session.dialogue.forget()

        ports = set()

        @pytest.mark.parametrize("number", range(3))
        def test_shared(robot, number):
            ports.add(robot.port)
            driver = Driver(robot.host, robot.port)
            assert driver.ask("get joint position").startswith("0.0 0.52")
            driver.ask(FAR)
            robot.advance(0.5)
            robot.dialogue.assert_said("joint move", times=1)
            robot.backdoor.emergency_stop()
            driver.close()
            assert len(ports) == 1

        def test_failed(robot):
            driver = Driver(robot.host, robot.port)
            driver.ask("get mode")
            driver.close()
            raise AssertionError("on purpose")
        """,
        process=True,
    )
    result.assert_outcomes(passed=3, failed=1)
    result.stderr.no_fnmatch_line("*leaked*")
    result.stdout.fnmatch_lines(["*iiwa_session dialogue*", "*get mode*", "*iiwa_session state*"])
