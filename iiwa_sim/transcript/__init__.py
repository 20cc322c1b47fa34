"""Dialogues with a server as text: recorded, read, played and compared. See docs/recordings.md."""
