"""Position in a recording that is shown: it plays, pauses and jumps."""

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Times of the robot in a second of the viewer."""


class Player:
    """A place in a span of simulated time, moved by the time that passes for the viewer."""

    def __init__(self, start_s: float, end_s: float) -> None:
        """Stands still at the start."""
        self.start_s = start_s
        self.end_s = end_s
        self.time_s = start_s
        """The time that is shown, between start and end."""
        self.playing = False
        self.speed = 1.0

    def play(self) -> None:
        """Go on, from the start where it has come to the end."""
        if self.time_s >= self.end_s:
            self.time_s = self.start_s
        self.playing = True

    def pause(self) -> None:
        """Stand still."""
        self.playing = False

    def go_to(self, time_s: float) -> None:
        """Be there, or at the nearest there is; it goes on playing if it did."""
        self.time_s = min(max(time_s, self.start_s), self.end_s)

    def passes(self, real_s: float) -> None:
        """Go on by so much time of the viewer. At the end the recording stands still."""
        if self.playing:
            self.go_to(self.time_s + real_s * self.speed)
            self.playing = self.time_s < self.end_s
