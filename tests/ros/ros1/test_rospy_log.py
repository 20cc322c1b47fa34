"""What of rospy's lines comes into the log."""

from __future__ import annotations

import logging

import pytest

from iiwa_sim.ros.ros1.rospy_log import MOST, RospyFilter

TRACEBACK = "Inbound TCP/IP connection failed:\nTraceback (most recent call last):\n  x\nOSError: reset\n"


def test_a_traceback_in_words_is_one_line_and_a_flood_is_held_back(caplog: pytest.LogCaptureFixture) -> None:
    of_rospy = logging.getLogger("tests.rosout")
    of_rospy.addFilter(RospyFilter())
    of_rospy.warning("Unknown host %s", "a\n")
    for number in range(1000):
        of_rospy.error("%s", TRACEBACK)
        of_rospy.warning("Inbound TCP/IP connection failed by a client: %s", number)
    told = [record.getMessage() for record in caplog.records]
    assert told[:2] == ["Unknown host a", "Inbound TCP/IP connection failed: OSError: reset"]
    assert 1 + 2 * MOST <= len(told) <= 1 + 20 * MOST, "seconds pass here, too, if not many"
