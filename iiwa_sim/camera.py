"""Pictures of the cameras of a scene as PNG, rendered offscreen in a thread of their own."""

from __future__ import annotations

import copy
import os
import struct
import sys
import zlib
from concurrent.futures import Future, ThreadPoolExecutor
from importlib import import_module
from typing import Any

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.wording import harmless

WIDTH, HEIGHT, MOST_PIXELS = 640, 480, 4096
PART_COLOUR = (0.85, 0.6, 0.25, 1.0)
LACKS = "no picture by {kind} ({fault}): it needs iiwa-sim[camera], and EGL, or OSMesa with MUJOCO_GL=osmesa"


class Camera:
    """The cameras of one cell. `picture` is called between two ticks; rendering then takes its time."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._thread: ThreadPoolExecutor | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the cameras."""
        handling = self._controller.handling
        return () if handling is None or handling.scene is None else handling.scene.cameras

    def picture(self, name: str, width: int = WIDTH, height: int = HEIGHT) -> Future[bytes]:
        """Begin to render what a camera sees now; the result is a PNG.

        Raises `Refused` for an unknown camera and for a size out of range; the future raises it if rendering
        is not possible.
        """
        handling, names = self._controller.handling, self.names
        if handling is None or name not in names:
            there_are = f"the scene has {', '.join(names)}" if names else "the cell has no scene with cameras"
            raise Refused(EXECUTION, harmless(f"no camera {name!r}: {there_are}"))
        if not (1 <= width <= MOST_PIXELS and 1 <= height <= MOST_PIXELS):
            why = f"a picture of {width} x {height}: expected 1 to {MOST_PIXELS} pixels each"
            raise Refused(EXECUTION, why)
        world = handling.world
        world.catch_up(now=True)
        model, data = copy.copy(world.model), copy.copy(world.data)
        model.geom_rgba[world.geoms] = PART_COLOUR
        if self._thread is None:
            self._thread = ThreadPoolExecutor(1, "iiwa-sim-camera")
        return self._thread.submit(_render, model, data, name, width, height)


def _render(model: Any, data: Any, name: str, width: int, height: int) -> bytes:
    import mujoco as mj
    from mujoco.rendering.classic import gl_context, renderer

    kind = os.environ.get("MUJOCO_GL") or ("cgl" if sys.platform == "darwin" else "egl")
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    try:
        gl_context.GLContext = import_module(f"mujoco.{kind}").GLContext
        drawn = renderer.Renderer(model, height, width)
    except Exception as fault:  # noqa: BLE001 - of any library of the system
        why = harmless(f"{type(fault).__name__}: {fault}")
        raise Refused(EXECUTION, LACKS.format(kind=kind, fault=why)) from None
    mj.mj_kinematics(model, data)
    mj.mj_camlight(model, data)
    with drawn:
        drawn.update_scene(data, name)
        return png(drawn.render().tobytes(), width, height)


def png(rgb: bytes, width: int, height: int) -> bytes:
    """Return a PNG of rows of pixels from the top, three bytes each.

    https://www.w3.org/TR/png-3: 8 bits of truecolour, no filter, no interlacing.
    """

    def chunk(kind: bytes, content: bytes) -> bytes:
        named = kind + content
        return struct.pack(">I", len(content)) + named + struct.pack(">I", zlib.crc32(named))

    rows = b"".join(b"\0" + rgb[3 * width * row : 3 * width * (row + 1)] for row in range(height))
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b"")
