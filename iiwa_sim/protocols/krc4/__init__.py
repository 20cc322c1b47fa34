"""KRC4's messages in XML."""
