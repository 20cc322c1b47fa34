"""What is said on the wire, as data: one table per protocol. Installed as iiwa_sim.protocol."""
