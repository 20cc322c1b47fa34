"""Network servers: they pass bytes on, and do not interpret them."""
