"""Pictures of the cameras of a scene as PNG, rendered offscreen in a thread of their own."""

from __future__ import annotations

import copy
import os
import struct
import sys
import zlib
from concurrent.futures import Future, ThreadPoolExecutor
from importlib import import_module
from typing import TYPE_CHECKING, Any

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.wording import harmless

if TYPE_CHECKING:
    from iiwa_sim.world.world import World

WIDTH, HEIGHT, MOST_PIXELS = 640, 480, 4096
PART_COLOUR = (0.85, 0.6, 0.25, 1.0)
LACKS = "no picture by {kind} ({fault}): it needs iiwa-sim[camera], and EGL, or OSMesa with MUJOCO_GL=osmesa"


class Camera:
    """The cameras of one cell. `picture` is called between two ticks; rendering then takes its time."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._thread: ThreadPoolExecutor | None = None
        self._source: Any = None  # the model that the copy is of
        self._model: Any = None
        self._rendering: tuple[Any, ...] | None = None  # that model, and the contexts made for it
        self._size = (0, 0)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the cameras."""
        handling = self._controller.handling
        return () if handling is None or handling.scene is None else handling.scene.cameras

    def picture(self, name: str, width: int = WIDTH, height: int = HEIGHT) -> Future[bytes]:
        """Begin to render what a camera sees now; the result is a PNG.

        Raises `Refused` for a camera that the scene does not have and for a size out of range; the future
        raises it where nothing can be rendered.
        """
        handling, names = self._controller.handling, self.names
        if handling is None or name not in names:
            there_are = f"the scene has {', '.join(names)}" if names else "the cell has no scene with cameras"
            raise Refused(EXECUTION, harmless(f"no camera {name!r}: {there_are}"))
        if not (1 <= width <= MOST_PIXELS and 1 <= height <= MOST_PIXELS):
            raise Refused(
                EXECUTION, f"a picture of {width} x {height}: expected 1 to {MOST_PIXELS} pixels each"
            )
        world = handling.world
        if self._source is not world.model:
            self._source, self._model = world.model, _painted(world)
        if self._thread is None:
            self._thread = ThreadPoolExecutor(1, "iiwa-sim-camera")
        return self._thread.submit(self._render, self._model, world.seen(), name, width, height)

    def _render(self, model: Any, data: Any, name: str, width: int, height: int) -> bytes:
        import mujoco as mj
        import numpy as np

        mj.mj_kinematics(model, data)
        mj.mj_camlight(model, data)
        if self._rendering is None or self._rendering[0] is not model or self._size != (width, height):
            self._size = width, height
            model.vis.global_.offwidth, model.vis.global_.offheight = width, height
            if self._rendering is not None:
                _, gl, context, _ = self._rendering
                self._rendering = None
                context.free()
                gl.free()
            gl = _context(width, height)
            context = mj.MjrContext(model, mj.mjtFontScale.mjFONTSCALE_100.value)
            mj.mjr_setBuffer(mj.mjtFramebuffer.mjFB_OFFSCREEN.value, context)
            self._rendering = model, gl, context, mj.MjvScene(model, maxgeom=model.ngeom + 1000)
        *_, context, scene = self._rendering
        seen = mj.MjvCamera()
        seen.type, seen.fixedcamid = mj.mjtCamera.mjCAMERA_FIXED, model.camera(name).id
        mj.mjv_updateScene(model, data, mj.MjvOption(), None, seen, mj.mjtCatBit.mjCAT_ALL.value, scene)
        pixels = np.empty((height, width, 3), np.uint8)
        area = mj.MjrRect(0, 0, width, height)
        mj.mjr_render(area, scene, context)
        mj.mjr_readPixels(pixels, None, area, context)
        return png(pixels[::-1].tobytes(), width, height)


def png(rgb: bytes, width: int, height: int) -> bytes:
    """Return a PNG of rows of pixels from the top, three bytes each.

    https://www.w3.org/TR/png-3: 8 bits of truecolour, no filter, no interlacing.
    """
    rows = b"".join(b"\0" + rgb[3 * width * row : 3 * width * (row + 1)] for row in range(height))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = (b"IHDR", header), (b"IDAT", zlib.compress(rows, 1)), (b"IEND", b"")
    told = (
        struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(told)


def _context(width: int, height: int) -> Any:
    """Return a context of OpenGL for this thread, without a window. Raises `Refused` where there is none."""
    kind = os.environ.get("MUJOCO_GL") or ("cgl" if sys.platform == "darwin" else "egl")
    try:
        context = import_module(f"mujoco.{kind}").GLContext(width, height)
        context.make_current()
    except Exception as fault:  # noqa: BLE001 - of any library of the system
        why = harmless(f"{type(fault).__name__}: {fault}")
        raise Refused(EXECUTION, LACKS.format(kind=kind, fault=why)) from None
    return context


def _painted(world: World) -> Any:
    """Return a copy of the model, with parts in the colour that they have on the page."""
    model = copy.copy(world.model)
    model.geom_rgba[world.geoms] = PART_COLOUR
    return model
