"""Where jaws close on a part."""

from __future__ import annotations

from math import cos, radians, sin, sqrt

from iiwa_sim.contact.shapes import Box, Cylinder
from iiwa_sim.frames import Transform
from iiwa_sim.handling.gripper import Jaws
from iiwa_sim.handling.part import Part, X, Y, Z

_FLAT, _PARALLEL = sin(radians(5.0)), cos(radians(5.0))
# What is turned by less than 5 degrees lies on the pads with its whole face, or line.

Span = tuple[float, float]


def grip_width(part: Part, in_tcp: Transform) -> float:
    """Its width (m) between the jaws, along y of the TCP."""
    return 2.0 * part.reach(in_tcp.rotation, Y)


def on_pads(part: Part, in_tcp: Transform, jaws: Jaws) -> bool:
    """Whether both pads meet a part that is at this pose in the TCP: what of it is outermost along y lies on
    them, on both sides."""
    across, along = patch(part, in_tcp)
    x, _, z = in_tcp.translation
    wide, long = 0.5 * jaws.pad_wide_m, jaws.pad_long_m
    return all(
        x + side * across[0] - across[1] <= wide
        and x + side * across[0] + across[1] >= -wide
        and z + side * along[0] - along[1] <= 0.0
        and z + side * along[0] + along[1] >= -long
        for side in (-1.0, 1.0)
    )


def patch(part: Part, in_tcp: Transform) -> tuple[Span, Span]:
    """Of what is outermost along y of the TCP: along x and along z, how far its middle is from the middle of
    the part, and half its size (m). On the other side it is that far the other way."""
    rotation, shape = in_tcp.rotation, part.shape
    spans = []
    for axis in (X, Z):
        middle = half = 0.0
        if isinstance(shape, Box):
            for k in range(3):
                on, out = rotation[3 * axis + k] * shape[k], rotation[3 * Y + k]
                if abs(out) <= _FLAT:
                    half += abs(on)
                else:
                    middle += on if out > 0.0 else -on
        elif isinstance(shape, Cylinder):
            on, out = rotation[3 * axis + 2], rotation[3 * Y + 2]
            if abs(out) <= _FLAT:
                half = abs(on) * shape.half_z
            else:
                middle = on * shape.half_z if out > 0.0 else -on * shape.half_z
            if abs(out) >= _PARALLEL:
                half += shape.radius
            else:  # the point of the rim, or of the mantle, that is farthest out
                middle -= shape.radius * on * out / sqrt(max(1e-12, 1.0 - out * out))
        spans.append((middle, half))
    return spans[0], spans[1]
