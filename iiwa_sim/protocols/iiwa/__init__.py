"""The text protocol of the iiwa."""
