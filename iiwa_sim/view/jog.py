"""The tab Jog: buttons that move one axis, by one step or as long as a viewer holds them."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from math import radians
from typing import TYPE_CHECKING, Any

from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.view.connection import Driver

if TYPE_CHECKING:
    import viser

HOLD_HZ = 20.0
"""Rate of messages of a browser while a button is held."""
SILENCE_S = 0.25
"""Longest silence of the browser while a button is held; then the robot stops, and the switch falls."""
TAP_S = 0.3
"""A button that is held for less makes one step."""
PERIOD_S = 0.05
AHEAD_S = 1.0
"""Time from the position of a joint to its target, which bounds the motion if this process hangs."""
PIECE_S, TURN_PIECE_S = 0.5, 2.0
"""Durations of a piece of a line, and of a turn of the TCP, at the speeds below."""
JOINT_RAD_S, LINE_MM_S, TURN_RAD_S = radians(100.0), 1000.0, radians(90.0)
"""Speeds near those of relative speed 1, for the sizes of targets and pieces."""
MARGIN_RAD = 1e-4
"""Distance of targets from the limits of joints."""
CARTESIAN = ("X", "Y", "Z", "Rx", "Ry", "Rz")
COMMANDS = {"Joints": "", "Base": "lin relative move", "Tool": "lin tool relative move"}
"""Commands that move along an axis of a frame."""

Tell = Callable[[Any, str], None]
"""Shows a client a text."""


class Jog:
    """One robot, moved by one viewer at a time. A thread serves presses from `start` to `stop`."""

    def __init__(self, gui: viser.GuiApi, robot: RobotDescription, driver: Driver, tell: Tell) -> None:
        self._robot, self._driver, self._tell = robot, driver, tell
        self._user: Any = None
        """Client that has ticked Enable."""
        self._sign = self._number = 0
        self._taps: deque[int] = deque()  # their signs
        self._is_held = self._is_jogging = self._is_own = False
        self._pressed_s = self._heard_s = 0.0
        self._goal: list[float] | None = None  # of the joints, at the end of the step under way
        self._press, self._release, self._over = threading.Event(), threading.Event(), False
        hint = "the robot stops, and the switch falls, when the browser is silent for 0.25 s"
        self._enable: Any = gui.add_checkbox("Enable", False, hint=hint)
        self._frame: Any = gui.add_button_group("Frame", tuple(COMMANDS))
        self._axis: Any = gui.add_button_group("Axis", robot.joints)
        self._step: Any = gui.add_button_group("Step", ("1", "0.1", "5", "10"), hint="degrees or mm")
        self._speed: Any = gui.add_slider("Speed (%)", min=1, max=100, step=1, initial_value=10)
        self._buttons = [self._button(gui, sign) for sign in (-1, 1)]
        self._enable.on_update(self._switched)
        self._frame.on_click(lambda _: self._choose(0))
        self._axis.on_click(lambda _: self._choose(self._axis.options.index(self._axis.value)))
        self._step.on_click(lambda _: self._choose(self._number))
        self._choose(0)
        self._thread = threading.Thread(target=self._run, name="iiwa-sim-jog", daemon=True)

    def start(self) -> None:
        """Serve presses."""
        self._thread.start()

    def stop(self) -> None:
        """Stop a motion and end the thread."""
        self._over, self._is_held = True, False
        self._release.set()
        self._press.set()
        self._thread.join()

    def leave(self, client: Any) -> None:
        """Clear the switch of a client that is gone."""
        if self._user is not None and self._user.client_id == client.client_id:
            self._disable()

    def _choose(self, number: int) -> None:
        """Have the buttons move an axis, counted from 0."""
        self._number = number
        names = CARTESIAN if COMMANDS[self._frame.value] else self._robot.joints
        self._axis.options = names
        unit = "mm" if self._is_line else "deg"
        for button, sign in zip(self._buttons, "-+", strict=True):
            button.label = f"{sign}  {names[number]}  (tap: {self._step.value} {unit})"

    @property
    def _is_line(self) -> bool:
        return bool(COMMANDS[self._frame.value]) and self._number < 3

    def _button(self, gui: viser.GuiApi, sign: int) -> Any:
        async def held(event: Any) -> None:  # in viser's loop, in order
            now_s = time.monotonic()
            if self._user is None or event.client_id != self._user.client_id:
                return
            if not self._is_held:
                self._is_held, self._sign, self._pressed_s = True, sign, now_s
                self._release.clear()
                self._press.set()
            self._heard_s = now_s

        async def released(event: Any) -> None:
            if self._user is None:
                self._tell(event.client, "tick Enable first")
            elif event.client_id != self._user.client_id:
                self._tell(event.client, "another viewer has ticked Enable")
            else:
                if self._is_held and not self._is_jogging:
                    self._taps.append(sign)
                self._is_held = False
                self._release.set()
                self._press.set()

        button = gui.add_button("+" if sign > 0 else "-", hint="tap: one step; hold: jog")
        button.on_hold(held, callback_hz=HOLD_HZ)
        button.on_click(released)
        return button

    def _switched(self, event: Any) -> None:
        if event.client is not None:
            self._user, self._is_held = event.client if self._enable.value else None, False
            self._release.set()

    def _disable(self) -> None:
        self._user, self._is_held = None, False
        self._taps.clear()
        self._enable.value = False
        self._release.set()

    def _run(self) -> None:
        while self._press.wait() and not self._over:
            self._press.clear()
            user = self._user
            try:
                self._serve()
            except Exception as fault:  # noqa: BLE001 - of the robot, or of the connection
                self._disable()
                if user is not None:
                    self._tell(user, str(fault))

    def _serve(self) -> None:
        """Carry out a press, until the robot has stopped or the next press."""
        ask = self._driver.command
        if not self._is_own and ask("get status") == "moving":
            raise RuntimeError("another client moves the robot")
        self._is_own = False
        while self._taps:
            self._make_step(self._taps.popleft())
        while self._is_pressed():
            if time.monotonic() - self._pressed_s >= TAP_S:
                self._is_jogging = True
                try:
                    while self._is_pressed():
                        self._go_on()
                finally:
                    self._is_jogging = False
                    ask("stop")
        self._is_own = True
        while not self._press.wait(PERIOD_S):
            if ask("get status") == "stopped":
                self._is_own, self._goal = False, None
                return

    def _is_pressed(self) -> bool:
        """Wait for a period, and return True while a browser that is not silent holds the button."""
        self._release.wait(PERIOD_S)
        if self._is_held and time.monotonic() - self._heard_s > SILENCE_S:
            self._disable()
        return self._is_held

    def _go_on(self) -> None:
        """Send the next target of the joints, or the next piece of the line."""
        speed, ask, command = self._speed.value / 100.0, self._driver.command, COMMANDS[self._frame.value]
        if not command:
            joints = self._joints(self._now(), self._sign * speed * JOINT_RAD_S * AHEAD_S)
            ask("smart joint move", *joints, *[speed] * len(joints))
        elif ask("get queue") == "0":
            size = speed * (PIECE_S * LINE_MM_S if self._is_line else TURN_PIECE_S * TURN_RAD_S)
            ask(command, *self._shift(self._sign * size), speed, 0.5 * size if self._is_line else 0.0)

    def _make_step(self, sign: int) -> None:
        speed, ask, command = self._speed.value / 100.0, self._driver.command, COMMANDS[self._frame.value]
        size = sign * float(self._step.value)
        if command:
            ask(command, *self._shift(size if self._is_line else radians(size)), speed, 0.0)
        else:
            self._goal = self._joints(self._goal or self._now(), radians(size))
            ask("joint move", *self._goal, *[speed] * len(self._goal))

    def _now(self) -> list[float]:
        return [float(word) for word in self._driver.command("get joint position").split()]

    def _joints(self, joints: list[float], change_rad: float) -> list[float]:
        """Return joint positions (rad) with the axis changed, within its limits."""
        low, high = self._robot.position_min[self._number], self._robot.position_max[self._number]
        wanted = min(max(joints[self._number] + change_rad, low + MARGIN_RAD), high - MARGIN_RAD)
        return [*joints[: self._number], wanted, *joints[self._number + 1 :]]

    def _shift(self, size: float) -> list[float]:
        """Return x y z alpha beta gamma with the axis set; alpha is the turn about z, gamma about x."""
        shift = 6 * [0.0]
        shift[self._number if self._number < 3 else 8 - self._number] = size
        return shift
