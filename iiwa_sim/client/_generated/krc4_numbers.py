"""What the numbers in KRC4 messages mean.

Written by `python -m tools.client_source` from protocol/krc4.toml and errors.toml: not to be changed by hand.
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
    1: "there is no input or output of this number",
    2: "the number is that of an input, which nobody can set",
    3000: "anything that has no code of its own",
    3010: "the robot is not ready for this",
    3020: "the target is farther away than a direct move may go",
    3021: "the target, or the line to it, is out of reach",
    3022: "reachable only with the arm bent another way, or with another A3",
    3023: "a joint limit is in the way",
    3024: "a line through, from or to a singular pose",
    3030: "emergency stop",
    3040: "a line or message that makes no sense, or a servo timeout",
    3060: "protective stop",
}
