"""The page in Chromium without a screen: jog, push and stop the robot, as a user does with the mouse."""

from __future__ import annotations

import json
import subprocess
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

from iiwa_sim.client import Iiwa
from iiwa_sim.simulator import Simulator
from iiwa_sim.view.app import PANEL_PX
from tests.line_client import DEADLINE_S, wait_until
from tests.peers import program
from tests.view.viewer import page_at, place_of

pytestmark = pytest.mark.slow

WIDTH, HEIGHT = 900, 700
COARSE = """const real = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, options) {
  return real.call(this, kind, kind.startsWith("webgl") ? { ...options, antialias: false } : options) }"""
"""Smooth edges take four fifths of the time of a picture without a GPU."""
FIND = """(() => { for (const each of document.querySelectorAll("button, [role=tab], label"))
  if (each.innerText.trim().startsWith(%s) && each.offsetParent) {
    const r = each.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2] } })()"""
IS_ENABLED = """[...document.querySelectorAll("input[type=checkbox]")].some(
  each => each.offsetParent && each.checked)"""


class Browser:
    """A browser, by the Chrome DevTools protocol."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection, self._number = connection, 0

    def do(self, method: str, **values: object) -> dict[str, Any]:
        self._number += 1
        self._connection.send(json.dumps({"id": self._number, "method": method, "params": values}))
        while (answer := json.loads(self._connection.recv(DEADLINE_S))).get("id") != self._number:
            pass
        return dict(answer["result"])

    def evaluates(self, expression: str) -> Any:
        result = self.do("Runtime.evaluate", expression=expression, returnByValue=True)
        return result["result"].get("value")

    def shows(self, text: str) -> bool:
        return text in self.evaluates("document.body.innerText")

    def mouse(self, kind: str, x: float, y: float) -> None:
        button = {"button": "left", "buttons": 1, "clickCount": 1}
        self.do("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, **button)

    def place(self, text: str) -> tuple[float, float]:
        """Return the middle of a button, a tab or a label whose text begins so."""
        script, seen = FIND % json.dumps(text), [None]

        def is_at_rest() -> bool:
            """Return True if the element has not moved between two looks; a panel that fills moves it."""
            seen.append(self.evaluates(script))
            return seen[-1] is not None and seen[-4:] == [seen[-1]] * 4

        wait_until(is_at_rest)
        x, y = self.evaluates(script)
        return x, y

    def clicks(self, text: str) -> None:
        for kind in ("Pressed", "Released"):
            self.mouse(kind, *self.place(text))


@pytest.fixture
def browser(simulator: Simulator, tmp_path: Path) -> Iterator[Browser]:
    """A browser that has the page of the robot open."""
    chromium = program("chromium")
    options = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    options += ["--remote-debugging-port=0", f"--user-data-dir={tmp_path}", f"--window-size={WIDTH},{HEIGHT}"]
    with page_at(place_of(simulator)) as port:
        silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        with subprocess.Popen([chromium, *options, "about:blank"], **silent) as process:
            try:
                port_file = tmp_path / "DevToolsActivePort"
                wait_until(lambda: port_file.exists() and port_file.read_text() != "")
                with connect(_page(int(port_file.read_text().split()[0])), max_size=None) as connection:
                    browser = Browser(connection)
                    size: dict[str, Any] = {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1}
                    browser.do("Emulation.setDeviceMetricsOverride", mobile=False, **size)
                    browser.do("Page.enable")
                    browser.do("Page.addScriptToEvaluateOnNewDocument", source=COARSE)
                    browser.do("Page.navigate", url=f"http://127.0.0.1:{port}/")
                    browser.place("Jog")
                    yield browser
            finally:
                process.terminate()
                process.wait(DEADLINE_S)


def _page(port: int) -> str:
    """Return the address of the debugger of the browser's page."""
    opener, found = urllib.request.build_opener(urllib.request.ProxyHandler({})), []

    def is_there() -> bool:
        with opener.open(f"http://127.0.0.1:{port}/json", timeout=DEADLINE_S) as answer:
            found[:] = [each for each in json.load(answer) if each["type"] == "page"]
        return bool(found)

    wait_until(is_there)
    return str(found[0]["webSocketDebuggerUrl"])


def test_the_robot_is_jogged_and_stopped(simulator: Simulator, browser: Browser) -> None:
    def jogs() -> bool:
        """Hold the button; the switch falls where this machine lets the browser be silent for 0.25 s."""
        if not browser.evaluates(IS_ENABLED):
            browser.clicks("Enable")
            wait_until(lambda: bool(browser.evaluates(IS_ENABLED)))
        x, y = browser.place("+ A1")
        browser.mouse("Pressed", x, y)
        wait_until(lambda: simulator.joints[0] > 0.05 or not browser.evaluates(IS_ENABLED))
        browser.mouse("Released", x, y)
        return simulator.joints[0] > 0.05

    wait_until(jogs)
    wait_until(lambda: simulator.state().status == "stopped")
    browser.clicks("Emergency stop")
    browser.place("Emergency stop is PRESSED")
    assert simulator.state().error.code == 3030


def test_the_arm_is_pushed_by_the_mouse(simulator: Simulator, browser: Browser) -> None:
    """The view from the front has the middle of an upright arm in the middle of the picture."""
    simulator.backdoor.place((0.0,) * 7)
    with Iiwa(simulator.host, simulator.port) as robot:
        robot.start_gravity(300.0)
        wait_until(lambda: browser.shows("impedance"))
        browser.clicks("Front")
        x, y = 0.5 * (WIDTH - PANEL_PX), 0.5 * HEIGHT

        def drags() -> bool:
            browser.mouse("Released", x, y)
            browser.mouse("Pressed", x, y)
            for step in range(1, 11):
                browser.mouse("Moved", x + 10.0 * step, y)
            return (
                abs(simulator.state().joint_torque[1]) > 1.0 or abs(simulator.state().joint_torque[0]) > 1.0
            )

        wait_until(drags)
        browser.mouse("Released", x, y)
        wait_until(lambda: not any(simulator.state().joint_torque))
