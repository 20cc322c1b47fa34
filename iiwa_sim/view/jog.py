"""The tab Jog: buttons that move one axis, by one step or as long as a viewer holds them."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from math import radians
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from iiwa_sim.view.connection import Station, tell

if TYPE_CHECKING:
    import viser

HOLD_HZ = 20.0
"""Rate of messages of a browser while a button is held."""
SILENCE_S = 0.25
"""Longest silence of the browser while the robot jogs; then the robot stops, and the switch falls."""
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


@dataclass(eq=False)
class Press:
    """A button that a viewer presses."""

    sign: int
    began_s: float
    is_tap: bool = True


class Jog:
    """One robot, moved by one viewer at a time, in a thread that ends with `stop`.

    Callbacks are coroutines: viser runs these in the order of a browser's messages.
    """

    def __init__(self, gui: viser.GuiApi, station: Station) -> None:
        self._robot, self._ask = station.robot, station.command
        self._user: Any = None
        """Client that has ticked Enable."""
        self._number = 0  # of the axis
        self._held: Press | None = None
        self._heard_s = 0.0
        self._presses: SimpleQueue[Press | None] = SimpleQueue()
        self._release = threading.Event()
        hint = "the robot stops, and the switch falls, when the browser is silent for 0.25 s"
        self._enable: Any = gui.add_checkbox("Enable", False, hint=hint)
        self._frame: Any = gui.add_button_group("Frame", tuple(COMMANDS))
        self._axis: Any = gui.add_button_group("Axis", self._robot.joints)
        self._step: Any = gui.add_button_group("Step", ("1", "0.1", "5", "10"), hint="degrees or mm")
        self._speed: Any = gui.add_slider("Speed (%)", min=1, max=100, step=1, initial_value=10)
        self._buttons = [self._button(gui, sign) for sign in (-1, 1)]
        self._enable.on_update(self._switched)
        for group in (self._frame, self._axis, self._step):
            group.on_click(self._chosen)
        self._choose(0)
        self._thread = threading.Thread(target=self._run, name="iiwa-sim-jog", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop a motion and end the thread."""
        self._disable()
        self._presses.put(None)
        self._thread.join()

    def leave(self, client: Any) -> None:
        """Clear the switch of a client that is gone."""
        if self._user is not None and self._user.client_id == client.client_id:
            self._disable()

    async def _chosen(self, event: Any) -> None:
        axis = self._axis.options.index(self._axis.value)
        self._choose({"Frame": 0, "Axis": axis}.get(event.target.label, self._number))

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
        async def held(event: Any) -> None:
            if self._user is None or event.client_id != self._user.client_id:
                return
            self._heard_s = time.monotonic()
            if self._held is None:
                self._held = Press(sign, self._heard_s)
                self._release.clear()
            elif self._held.is_tap and self._heard_s - self._held.began_s >= TAP_S:
                self._held.is_tap = False
                self._presses.put(self._held)

        async def released(event: Any) -> None:
            if self._user is None:
                tell(event.client, "tick Enable first")
            elif event.client_id != self._user.client_id:
                tell(event.client, "another viewer has ticked Enable")
            else:
                if self._held is not None and self._held.is_tap:
                    self._presses.put(self._held)
                self._let_go()

        button = gui.add_button("+" if sign > 0 else "-", hint="tap: one step; hold: jog")
        button.on_hold(held, callback_hz=HOLD_HZ)
        button.on_click(released)
        return button

    async def _switched(self, event: Any) -> None:
        if event.client is not None:
            self._user = event.client if self._enable.value else None
            self._let_go()

    def _let_go(self) -> None:
        self._held = None
        self._release.set()

    def _disable(self) -> None:
        self._user, self._enable.value = None, False
        self._let_go()

    def _run(self) -> None:
        while (press := self._presses.get()) is not None:
            user = self._user
            try:
                if user is not None:
                    self._serve(press)
            except Exception as fault:  # noqa: BLE001 - of the robot, or of the connection
                self._disable()
                tell(user, str(fault))

    def _serve(self, press: Press) -> None:
        """Make a step, or jog until the release; return when the robot has stopped."""
        if self._ask("get status") == "moving":
            raise RuntimeError("another client moves the robot")
        if press.is_tap:
            self._make_step(press.sign)
        else:
            try:
                while self._is_held(press):
                    self._go_on(press.sign)
            finally:
                self._ask("stop")
        while self._ask("get status") == "moving":
            time.sleep(PERIOD_S)

    def _is_held(self, press: Press) -> bool:
        """Wait for a period, and return True while a browser that is not silent holds the button."""
        self._release.wait(PERIOD_S)
        if self._held is press and time.monotonic() - self._heard_s > SILENCE_S:
            self._disable()
        return self._held is press

    def _go_on(self, sign: int) -> None:
        """Send the next target of the joints, or the next piece of the line."""
        speed, command = self._speed.value / 100.0, COMMANDS[self._frame.value]
        if not command:
            self._move_joint("smart joint move", sign * speed * JOINT_RAD_S * AHEAD_S, speed)
        elif self._ask("get queue") == "0":
            size = speed * (PIECE_S * LINE_MM_S if self._is_line else TURN_PIECE_S * TURN_RAD_S)
            self._ask(command, *self._shift(sign * size), speed, 0.5 * size if self._is_line else 0.0)

    def _make_step(self, sign: int) -> None:
        speed, command = self._speed.value / 100.0, COMMANDS[self._frame.value]
        size = sign * float(self._step.value) * (1.0 if self._is_line else radians(1.0))
        if command:
            self._ask(command, *self._shift(size), speed, 0.0)
        else:
            self._move_joint("joint move", size, speed)

    def _move_joint(self, command: str, change_rad: float, speed: float) -> None:
        """Send the positions of the joints with the axis changed, within its limits."""
        joints = [float(word) for word in self._ask("get joint position").split()]
        low, high = self._robot.position_min[self._number], self._robot.position_max[self._number]
        wanted = min(max(joints[self._number] + change_rad, low + MARGIN_RAD), high - MARGIN_RAD)
        joints[self._number] = wanted
        self._ask(command, *joints, *[speed] * len(joints))

    def _shift(self, size: float) -> list[float]:
        """Return x y z alpha beta gamma with the axis set; alpha is the turn about z, gamma about x."""
        shift = 6 * [0.0]
        shift[self._number if self._number < 3 else 8 - self._number] = size
        return shift
