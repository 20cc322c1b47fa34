"""Appendix A: the topics and services of drag&bot's drivers, as plain messages without a transport."""
