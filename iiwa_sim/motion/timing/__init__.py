"""The nominal motion along a course: the fastest run without jerk limits, its average, its segments."""
