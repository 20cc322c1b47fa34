"""Dialogues with a server as text: recorded, read, played and compared. docs/transcripts.md tells how."""
