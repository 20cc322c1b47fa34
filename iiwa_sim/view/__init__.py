"""The live page by viser: a process of its own, and a client of the backdoor."""
