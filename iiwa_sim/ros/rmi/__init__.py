"""The topics and services of drag&bot's drivers (Appendix A of its requirements): messages, no transport."""
