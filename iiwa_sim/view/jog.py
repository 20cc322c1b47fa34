"""The tab Jog: buttons that move one axis, by one step or as long as a viewer holds them."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from math import pi, radians
from typing import TYPE_CHECKING, Any

from iiwa_sim.view.connection import Station, notify

if TYPE_CHECKING:
    import viser

HOLD_HZ = 20.0
"""Rate of messages of a browser while a button is held."""
SILENCE_S = 0.25
"""Longest silence of the browser while the robot jogs; then the robot stops, and the switch falls."""
TAP_S = 0.3
"""A button that is held for less makes one step."""
PERIOD_S = 0.05
AHEAD_RAD, LINE_MM, TURN_RAD = radians(100.0), 500.0, pi
"""At full speed: lead of a joint's target, pieces of a line and of a turn of the TCP.
The lead bounds the motion if this process hangs."""
MARGIN_RAD = 1e-4
"""Distance of targets from the limits of joints."""
CARTESIAN = ("X", "Y", "Z", "Rx", "Ry", "Rz")
COMMANDS = {"Joints": "", "Base": "lin relative move", "Tool": "lin tool relative move"}
"""Commands that move along an axis of a frame."""


class Jog:
    """One robot, moved by one viewer at a time, in a thread that ends with `stop`.

    Callbacks are coroutines: viser runs these in the order of a browser's messages.
    """

    def __init__(self, gui: viser.GuiApi, station: Station) -> None:
        self._robot, self._ask = station.robot, station.command
        self._user: Any = None
        """Client that has ticked Enable."""
        self._release: threading.Event | None = None  # of the button that is held
        self._last_message_s = 0.0
        self._thread = ThreadPoolExecutor(1, "iiwa-sim-jog")
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
        self._show_axis()

    def stop(self) -> None:
        """Stop a motion and end the thread."""
        self._disable()
        self._thread.shutdown()

    def leave(self, client: Any) -> None:
        """Clear the switch of a client that is gone."""
        if self._user is client:
            self._disable()

    async def _chosen(self, _: Any) -> None:
        self._show_axis()

    def _show_axis(self) -> None:
        self._axis.options = names = CARTESIAN if COMMANDS[self._frame.value] else self._robot.joints
        unit, frame = "mm" if self._is_line else "deg", self._frame.value
        axis = f"{names[self._number]} of the {frame.lower()}" if COMMANDS[frame] else names[self._number]
        for button, sign in zip(self._buttons, "-+", strict=True):
            button.label = f"{sign}  {axis}  (tap: {self._step.value} {unit})"

    @property
    def _number(self) -> int:
        """The axis, from 0; the first one until a viewer has chosen one of this frame."""
        return self._axis.options.index(self._axis.value) if self._axis.value in self._axis.options else 0

    @property
    def _is_line(self) -> bool:
        return bool(COMMANDS[self._frame.value]) and self._number < 3

    def _button(self, gui: viser.GuiApi, sign: int) -> Any:
        async def held(event: Any) -> None:
            if event.client is self._user:
                self._last_message_s = time.monotonic()
                if self._release is None:
                    self._release = threading.Event()
                    self._thread.submit(self._serve, sign, self._release)

        async def released(event: Any) -> None:
            if event.client is self._user:
                self._let_go()
            else:
                notify(event.client, "tick Enable first; one viewer at a time can have it")

        button = gui.add_button("+" if sign > 0 else "-", hint="tap: one step; hold: jog")
        button.on_hold(held, callback_hz=HOLD_HZ)
        button.on_click(released)
        return button

    async def _switched(self, event: Any) -> None:
        if event.client is not None:
            self._user = event.client if self._enable.value else None
            self._let_go()

    def _let_go(self) -> None:
        if self._release is not None:
            self._release.set()
        self._release = None

    def _disable(self) -> None:
        self._user, self._enable.value = None, False
        self._let_go()

    def _serve(self, sign: int, release: threading.Event) -> None:
        """Make a step, or jog until the release; return when the robot has stopped."""
        if (user := self._user) is None:
            return
        try:
            if self._ask("get status") == "moving":
                raise RuntimeError("another client moves the robot")
            if release.wait(TAP_S):
                if self._user is user:  # still connected
                    self._move(sign, is_step=True)
            else:
                try:
                    while not release.wait(PERIOD_S):
                        if time.monotonic() - self._last_message_s > SILENCE_S:
                            raise TimeoutError(f"the browser was silent for {SILENCE_S:g} s")
                        self._move(sign)
                finally:
                    self._ask("stop")
            while self._ask("get status") == "moving":
                time.sleep(PERIOD_S)
        except Exception as fault:  # noqa: BLE001 - of the robot, or of the connection
            self._disable()
            notify(user, str(fault))

    def _move(self, sign: int, is_step: bool = False) -> None:
        """Make a step, or send the next target of the joints, or the next piece of the line."""
        speed, command, number = self._speed.value / 100.0, COMMANDS[self._frame.value], self._number
        if is_step:
            size = float(self._step.value) if self._is_line else radians(float(self._step.value))
        else:
            size = speed * (LINE_MM if self._is_line else TURN_RAD if command else AHEAD_RAD)
        if not command:
            joints = [float(word) for word in self._ask("get joint position").split()]
            low, high = self._robot.position_min[number], self._robot.position_max[number]
            joints[number] = min(max(joints[number] + sign * size, low + MARGIN_RAD), high - MARGIN_RAD)
            self._ask("joint move" if is_step else "smart joint move", *joints, *[speed] * len(joints))
        elif is_step or self._ask("get queue") == "0":
            shift = 6 * [0.0]
            shift[number if number < 3 else 8 - number] = sign * size  # alpha is the turn about z
            self._ask(command, *shift, speed, 0.0 if is_step or number >= 3 else 0.5 * size)
