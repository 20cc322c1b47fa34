"""Check that a robot answers and moves: `python check_robot.py HOST PORT`. Replace it by your tests."""

import socket
import sys

with socket.create_connection((sys.argv[1], int(sys.argv[2])), timeout=10) as robot:
    replies = robot.makefile("r")
    for line in ("hello", "joint move : 0.1 0.5 0 -1.2 0 1.4 0 1 1 1 1 1 1 1", "get status"):
        robot.sendall(f"{line}\r\n".encode())
        print(line, "->", replies.readline().strip())
    while True:
        robot.sendall(b"get status\r\n")
        if replies.readline().strip() == "stopped":
            break
    robot.sendall(b"get joint position\r\n")
    arrived = [float(word) for word in replies.readline().split()]
    if abs(arrived[5] - 1.4) > 1e-6:
        sys.exit(f"the robot is at {arrived}")
