"""When the robot is where on its course: fastest run, moving average, and the clock that keeps all limits."""
