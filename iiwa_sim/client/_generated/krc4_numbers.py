"""What the numbers in KRC4 messages mean.

Written by `python -m tools.client_source` from protocol/krc4.toml: not to be changed by hand.
"""

COMMANDS = {
    "STO": 1,
    "LIN": 10,
    "LIA": 15,
    "PTP": 20,
    "PTA": 25,
    "FIN": 100,
    "SIO": 200,
    "GIO": 210,
    "DIS": 300,
    "GOP": 310,
    "GOA": 320,
}

ERRORS = {
    3000: "anything that has no number of its own",
    3010: "the drives are off",
    3020: "the target is not reachable",
    3021: "the target, or the line to it, is out of reach",
    3022: "reachable only with the arm bent another way",
    3023: "a joint limit is in the way",
    3024: "a line through, from or to a singular pose",
    3030: "emergency stop, until it is reset",
    3060: "protective stop, until it is reset",
    3040: "a message that makes no sense, or a servo timeout that was not reset",
    1: "there is no IO of this number",
    2: "the IO of this number is an input, which nobody can set",
}
