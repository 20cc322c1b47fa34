"""Topics of the cameras of a scene. Pictures are rendered while the topic has listeners."""

from __future__ import annotations

import re
from asyncio import Future, wrap_future
from functools import partial

from iiwa_sim.camera import Camera
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.log import SessionLog
from iiwa_sim.ros.graph import Graph, Topic

IMAGE = "sensor_msgs/msg/CompressedImage"
RATE_HZ = 10


class Images:
    """A topic `/camera/NAME/compressed` for each camera, at most `RATE_HZ` times in a simulated second."""

    def __init__(self, graph: Graph, controller: Controller, log: SessionLog) -> None:
        self._graph, self._log, self._camera = graph, log, Camera(controller)
        names = {re.sub(r"[^A-Za-z0-9_]", "_", name): name for name in self._camera.names}
        self._topics = {f"/camera/{short}/compressed": name for short, name in names.items()}
        graph.published |= {topic: Topic(IMAGE, RATE_HZ, None, in_ros1=True) for topic in self._topics}
        self._rendered: dict[str, Future[bytes]] = {}

    def step(self) -> None:
        """Notice a tick: begin the pictures that are due, unless the last one is not done yet."""
        for topic, name in self._topics.items() if self._graph.is_due(RATE_HZ) else ():
            if self._graph.published[topic].listeners and topic not in self._rendered:
                self._rendered[topic] = future = wrap_future(self._camera.picture(name))
                future.add_done_callback(partial(self._publish, topic, self._graph.header(name)))

    def _publish(self, topic: str, header: dict[str, object], done: Future[bytes]) -> None:
        try:
            message = {"header": header, "format": "png", "data": done.result()}
        except Refused as refused:  # it stays in `_rendered`: no picture is requested again
            self._log.refused("ROS", topic, refused.code, refused.reason)
            return
        del self._rendered[topic]
        self._graph.published[topic].publish(message)
