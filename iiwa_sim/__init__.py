"""iiwa-sim: a robot controller in software that speaks the text protocol of the KUKA LBR iiwa.

PYTEST_DONT_REWRITE keeps pytest, which loads our plugin, from a warning where this was imported before.
"""
