"""Meshes of links, for viewers: files beside a URDF, or the ones that it names."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from iiwa_sim.frames import IDENTITY, Frame, Transform, Vector

FOLDER = "meshes"
"""Folder beside the URDF. Its file LINK.glb stands for all visuals of a link."""


class LinkMesh(NamedTuple):
    """A file with a mesh (m), and its pose and scale in the frame of a link."""

    path: Path
    pose: Transform = IDENTITY
    scale: Vector = (1.0, 1.0, 1.0)
    colour: tuple[float, ...] | None = None
    """Red, green, blue, opacity from the URDF, 0 to 1 (sRGB), if it has any."""


def link_meshes(urdf: str, urdf_path: str) -> dict[str, list[LinkMesh]]:
    """Return the meshes of each link that has any, by the link's name.

    Args:
        urdf: Text of a URDF that a model accepts.
        urdf_path: Path of that URDF; a mesh that is not found from there is left out.
    """
    found, robot = {}, ET.fromstring(urdf)
    colours = {each.get("name"): each.find("color") for each in robot.findall("material")}
    for link in robot.findall("link"):
        name, own = link.get("name", ""), Path(urdf_path).parent / FOLDER
        own = own / f"{name}.glb"
        meshes = [LinkMesh(own)] if own.is_file() else list(_named(link, Path(urdf_path), colours))
        if meshes:
            found[name] = meshes
    return found


def _named(
    link: ET.Element, urdf_path: Path, colours: Mapping[str | None, ET.Element | None]
) -> Iterator[LinkMesh]:
    for visual in link.findall("visual"):
        mesh = visual.find("geometry/mesh")
        path = None if mesh is None else _file(mesh.get("filename", ""), urdf_path)
        if mesh is not None and path is not None:
            origin = visual.find("origin")
            x, y, z = _numbers(origin, "xyz", 0.0)
            roll, pitch, yaw = _numbers(origin, "rpy", 0.0)
            pose = Frame(1e3 * x, 1e3 * y, 1e3 * z, yaw, pitch, roll).to_transform()
            material = visual.find("material")
            colour = None if material is None else material.find("color")
            colour = colours.get(material.get("name")) if material is not None and colour is None else colour
            rgba = None if colour is None else tuple(map(float, colour.get("rgba", "1 1 1 1").split()))
            yield LinkMesh(path, pose, _numbers(mesh, "scale", 1.0), rgba)


def _file(name: str, urdf_path: Path) -> Path | None:
    """Find a file by its name in a URDF; a package is a folder above the URDF, or beside one of those."""
    kind, _, rest = name.rpartition("://")
    if kind != "package":
        places = [urdf_path.parent / rest]
    else:
        package, _, inside = rest.partition("/")
        above = urdf_path.absolute().parents
        places = [each / inside for each in above if each.name == package]
        places += [each / package / inside for each in above]
    return next((each for each in places if each.is_file()), None)


def _numbers(element: ET.Element | None, key: str, default: float) -> Vector:
    words = "" if element is None else element.get(key, "")
    x, y, z = map(float, words.split()) if words else (default,) * 3
    return (x, y, z)
