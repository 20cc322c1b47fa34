"""The bodies of a cell: parts, scenes and grippers, which MuJoCo moves beside arms whose motion is imposed.

A cell without bodies does not load `world.World`, which imports MuJoCo. No sockets, threads, clock or log.
"""
