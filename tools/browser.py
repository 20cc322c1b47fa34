"""Tries the live page in a real browser, Chromium without a window, and says what it found.

    .venv/bin/pip install playwright
    .venv/bin/python -m tools.browser --shots build/shots

A robot is started with a page, and somebody opens that, with nothing but this machine within reach: types a
stiffness move, and pushes the arm with the mouse meanwhile; presses the emergency stop, releases and resets
it, has a reply come late, and finds it in the dialogue; stops it by Ctrl-E while writing a command; opens
the page on a machine that is set to dark, and on a telephone. At each step it is looked at what the robot
does, by its own ports, and a picture is kept. At last the browser's frames are counted. Exit code 1 where a
step has not come to pass.

`tests/view/test_browser.py` takes the same steps, where Playwright and a Chromium are installed.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import shutil
import sys
import time
from collections.abc import Callable
from math import hypot
from pathlib import Path
from typing import Any

from tools.shown_robot import Robot, started

EMERGENCY_STOP = 3030
SLOW_S = 400.0
"""Longest time of a step; what a quick machine needs is some 20 s for all of them."""
MS = 1000.0
MISSED = Path("build", "shots", "missed.png")
"""A picture of the page when a step has not come to pass."""
SIZE = {"width": 900, "height": 600}
FLANGE = (485, 272)
"""Where the arm's last link is in a window of that size, at home, as the camera first stands."""
STIFFNESS_MOVE = "linstiff move : 450 200 520 0 -1.57079 0 {speed:g} 300 0 0 0 0 0 0"
SLOW, SLOWEST = 0.002, 1e-5
"""Speeds of it: the slowest goes nowhere while a slow browser finds the flange where it was."""
ASIDE_MM = 5.0
"""So far from the line of that move the TCP is when it has been pushed."""
PHONE = {"width": 390, "height": 844}
SMALL = {"width": 480, "height": 320}
COUNTED_S = 10.0
GOAL_HZ = 25.0
ARGUMENTS = (
    "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage"
)  # fmt: skip
DRAWS = """() => {
    const drawn = document.createElement("canvas").getContext("webgl2");
    return drawn === null ? "" : `${drawn.getParameter(drawn.VERSION)}`;
}"""
GONE = ("closed", "crashed")
"""Words of Playwright for a browser, or a page in it, that has ended by itself."""
COUNT = """async milliseconds => {
    let frames = 0;
    const end = performance.now() + milliseconds;
    await new Promise(done => {
        const next = () => { frames += 1; performance.now() < end ? requestAnimationFrame(next) : done(); };
        requestAnimationFrame(next);
    });
    return frames;
}"""


class Missed(Exception):
    """A step that has not come to pass. The message says which."""


class Unusable(Exception):
    """A browser that does not start, draws nothing, or ends by itself. The message says which."""


def main() -> int:
    options = _options()
    options.shots.mkdir(parents=True, exist_ok=True)
    playwright = importlib.import_module("playwright.sync_api").sync_playwright
    try:
        with started() as robot, playwright() as library:
            browser = launched(library, options.browser)
            walk(browser, robot, options.shots)
            for kind, picture in (("telephone", PHONE), ("small window", SMALL)):
                frames_hz = _frames_hz(browser, robot, picture, options.shots / f"{kind.split()[0]}.png")
                print(f"{kind}, {picture['width']} x {picture['height']}: {frames_hz:.1f} frames a second")
            print(f"goal: {GOAL_HZ:g} at a small size, on a machine with nothing else to do")
            browser.close()
    except Missed as missed:
        print(f"not seen: {missed}", file=sys.stderr)
        return 1
    except Unusable as fault:
        print(fault, file=sys.stderr)
        return 1
    return 0


def launched(library: Any, path: str | None) -> Any:
    """A Chromium that can draw. Raises Unusable for one that cannot."""
    try:
        browser = library.chromium.launch(executable_path=path, args=[*ARGUMENTS], timeout=SLOW_S * MS)
        page = browser.new_page()
        drawn_by = page.evaluate(DRAWS)
        page.close()
    except Exception as fault:
        raise Unusable(f"the browser {path} does not start: {str(fault).splitlines()[0]}") from fault
    if not drawn_by:
        raise Unusable(f"the browser {path} draws no WebGL")
    return browser


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="tools.browser", description=__doc__.partition("\n")[0])
    parser.add_argument("--shots", type=Path, default=Path("build/shots"), help="folder for pictures")
    parser.add_argument("--browser", default=shutil.which("chromium"), help="the program")
    return parser.parse_args()


def walk(browser: Any, robot: Robot, shots: Path) -> None:
    """All that a person does, one after the other. Raises Missed for what does not come to pass."""
    context = browser.new_context(viewport=SIZE)
    page = context.new_page()
    page.set_default_timeout(SLOW_S * MS)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    _step("the page opens", lambda: _open(page, robot), page, shots / "1-open.png")
    elsewhere = [url for url in asked if not url.startswith((robot.url, f"blob:{robot.url}", "data:"))]
    if elsewhere:
        raise Missed(f"a page that asks nobody else: it asks for {elsewhere[0]}")
    print(f"the page has asked for {len(asked)} things, all of them of itself")

    def typed(line: str) -> None:
        page.get_by_role("tab", name="Dialogue").click()
        _command(page).fill(line)
        page.keyboard.press("Enter")

    def pushed() -> None:
        typed(STIFFNESS_MOVE.format(speed=SLOWEST))
        _until("the stiffness move", lambda: robot.state()["mode"] == "impedance")
        page.get_by_role("tab", name="Push").click()
        _until("a force on the robot", lambda: _drag(page, robot))
        robot.driver.linstiff_move((450.0, 200.0, 520.0, 0.0, -1.57079, 0.0), SLOW, 300.0, (0.0,) * 6)
        _until("the robot gives way", lambda: _aside_mm(robot) > ASIDE_MM)
        page.get_by_text("torques (Nm)").wait_for()  # told while there are any; the force itself is drawn

    def let_go() -> None:
        page.mouse.up()
        _until("no force any more", lambda: not any(robot.state()["cartesian_force"]))

    def stopped() -> None:
        page.get_by_role("button", name="Emergency stop").click()
        _until("the emergency stop", lambda: robot.state()["error"]["code"] == EMERGENCY_STOP)
        page.get_by_text("pressed").wait_for()

    def reset() -> None:
        page.get_by_role("button", name="Release").click()
        _until("the release", lambda: robot.state()["robot_status"][1] == 0)
        page.get_by_role("button", name="Reset error").click()
        _until("the reset", lambda: robot.state()["error"]["code"] == 0)

    def broken() -> None:
        page.get_by_role("tab", name="Faults").click()
        page.get_by_role("button", name="Set", exact=True).click()
        page.wait_for_timeout(500.0)
        robot.driver.get_status()
        page.get_by_role("tab", name="Dialogue").click()
        page.get_by_text("get status").first.wait_for()
        page.get_by_text("~").first.wait_for()
        page.get_by_text("# delay replies").first.wait_for()

    def stopped_by_key() -> None:
        _command(page).click()
        page.keyboard.type("get error")
        page.keyboard.press("Control+e")
        _until("the emergency stop", lambda: robot.state()["error"]["code"] == EMERGENCY_STOP)

    _step("a drag pushes the arm, in a stiffness move", pushed, page, shots / "2-push.png")
    _step("who lets go pushes no more", let_go, page)
    _step("a click on the emergency stop reaches the robot", stopped, page, shots / "3-stop.png")
    _step("release and reset", reset, page)
    _step("a reply comes late, and is found in the dialogue", broken, page, shots / "4-dialogue.png")
    _step("Ctrl-E stops it while a command is written", stopped_by_key, page)
    _step("release and reset", reset, page)
    context.close()
    context = browser.new_context(viewport=SIZE, color_scheme="dark")
    page = context.new_page()
    page.set_default_timeout(SLOW_S * MS)

    def dark() -> None:
        _open(page, robot)
        page.get_by_role("tab", name="Dialogue").click()
        page.locator('[data-mantine-color-scheme="dark"]').first.wait_for(state="attached")

    _step("on a machine that is set to dark the page is", dark, page, shots / "5-dark.png")
    context.close()


def _command(page: Any) -> Any:
    """The field in which commands are typed."""
    label = page.get_by_text("Command", exact=True)
    return label.locator("xpath=ancestor::*[.//input][1]//input").first


def _aside_mm(robot: Robot) -> float:
    """How far the TCP is from the line of the stiffness move."""
    x, _, z, *_ = robot.state()["tool_frame"]
    return float(hypot(x - 450.0, z - 520.0))


def _drag(page: Any, robot: Robot) -> bool:
    """Pull at the arm; whether that pushes it. Else, for a page that has not drawn the arm yet, let go."""
    x, y = FLANGE
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 9):
        page.mouse.move(x - 12 * step, y - 4 * step)
        page.wait_for_timeout(100.0)
    if any(robot.state()["cartesian_force"]):
        return True
    page.mouse.up()
    return False


def _open(page: Any, robot: Robot) -> None:
    page.goto(robot.url)
    page.get_by_role("button", name="Emergency stop").wait_for()
    page.get_by_text("TCP (mm, deg)").wait_for()


def _frames_hz(browser: Any, robot: Robot, size: dict[str, int], shot: Path) -> float:
    """Frames that the browser makes in a second, by its own count, while the arm moves."""
    context = browser.new_context(viewport=size)
    page = context.new_page()
    page.set_default_timeout(SLOW_S * MS)
    page.goto(f"{robot.url}?fixedDpr=0.5")
    page.get_by_text("iiwa-sim").first.wait_for()
    robot.driver.stop()
    there, back = (0.4, 0.6, 0.2, -1.2, 0.2, 1.3, 0.4), (-0.4, 0.5, 0.0, -1.0, 0.0, 1.5, 0.0)
    for _ in range(8):
        robot.driver.joint_move(there, [0.15] * 7)
        robot.driver.joint_move(back, [0.15] * 7)
    frames = page.evaluate(COUNT, COUNTED_S * MS)
    with contextlib.suppress(Exception):  # a picture takes long where the machine is busy
        page.screenshot(path=shot)
    robot.driver.stop()
    context.close()
    return float(frames) / COUNTED_S


def _step(what: str, act: Callable[[], object], page: Any, shot: Path | None = None) -> None:
    began_s = time.monotonic()
    try:
        act()
    except Exception as fault:
        reason = str(fault).splitlines()[0]
        if any(word in reason for word in GONE):
            raise Unusable(f"the browser has ended by itself: {reason}") from fault
        with contextlib.suppress(Exception):
            page.screenshot(path=MISSED)
        raise Missed(f"{what}: {reason}") from fault
    took_s = time.monotonic() - began_s
    if shot is not None:
        page.wait_for_timeout(700.0)
        page.screenshot(path=shot)
    print(f"{what}: {took_s:.1f} s{f', {shot}' if shot else ''}")


def _until(what: str, true: Callable[[], bool]) -> None:
    end_s = time.monotonic() + SLOW_S
    while not true():
        if time.monotonic() > end_s:
            raise Missed(what)
        time.sleep(0.05)


if __name__ == "__main__":
    sys.exit(main())
