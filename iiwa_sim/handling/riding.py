"""What becomes of parts when surfaces have moved: they ride up with what they lie on, or fall.

What is in the air comes to lie on a face that has passed its lowest place from below.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from iiwa_sim.handling.falling import FALLS, LIES, Body, landed, sag
from iiwa_sim.handling.ground import Ground, ground_of

_ROUNDING_M = 1e-9


def after_surfaces(bodies: Iterable[Body], before: Sequence[Ground], now: Sequence[Ground]) -> Iterator[Body]:
    """The parts that are not as they were, after the faces of surfaces have moved."""
    faces = list(now)
    others = [each for each in faces if each not in before]
    tops = {each.name: each.top for each in before}
    for body in sorted(bodies, key=height):
        if body.state == FALLS:
            onto = passed(body, faces, tops)
            if onto is None:
                continue
            after, ends = body._replace(on=onto.name), landed(body, onto)  # there in this tick
        elif body.state == LIES:
            after = ends = ridden(body, faces, others)
        else:
            continue
        if after != body:
            yield after
        face, was = _face_of(ends), _face_of(body)
        if ends.state == LIES and face is not None and was is not None:
            faces.append(face)
            tops[face.name] = was.top


def ridden(body: Body, faces: Sequence[Ground], moved_faces: Sequence[Ground]) -> Body:
    """What lies, after surfaces have moved: taken along upwards by the face on which it lies, or it falls.

    Onto what has moved in between it falls, too; in what stands it may have been before.
    """
    (x, y, z), bottom = body.pose.translation, body.bottom
    face = next((each for each in faces if each.name == body.on and each.has(x, y)), None)
    if face is None:
        return body._replace(state=FALLS, spin=0.0, wound=(), on="")
    between = [each for each in moved_faces if max(face.top, bottom) < each.top <= z and each.has(x, y)]
    if between:
        onto = max(between, key=lambda each: each.top)
        return body._replace(state=FALLS, spin=0.0, wound=(), on=onto.name)
    up = landed(body, face)
    rises_m = up.pose.translation[2] - z
    if body.wound and abs(rises_m) < 1e-3:
        return body  # it is pushed, and perhaps pressed in
    if rises_m < -_ROUNDING_M:
        return body._replace(state=FALLS, spin=0.0, wound=(), on=body.on)
    return body if rises_m <= _ROUNDING_M else up._replace(velocity=body.velocity)


def passed(body: Body, faces: Sequence[Ground], tops: Mapping[str, float]) -> Ground | None:
    """The highest face that has come up past the lowest place of a part in the air, from below, if any:
    `tops` says how high (m) faces were before. The part may have been in one already: it falls on in that."""
    (x, y, _), bottom = body.pose.translation, body.bottom
    found = [
        each
        for each in faces
        if tops.get(each.name, each.top) < each.top
        and tops[each.name] - sag(body.part, each) - _ROUNDING_M <= bottom < each.top
        and each.has(x, y)
    ]
    return max(found, key=lambda each: each.top, default=None)


def height(body: Body) -> tuple[float, str]:
    """The order of parts from below."""
    return body.pose.translation[2], body.part.name


def _face_of(body: Body) -> Ground | None:
    return ground_of(body.part.name, body.part.shape, body.pose, body.part.stiffness)
