"""Recordings of a robot in MCAP: written while it runs, read, drawn, exported, played: docs/recordings.md."""
