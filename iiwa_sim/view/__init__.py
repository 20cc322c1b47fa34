"""The live page: a robot to look at, to push and to stop, in a browser, by viser.

It is a process of its own, a client of the status port and of the backdoor: nothing of the simulator is known
here but what these two tell.
"""
