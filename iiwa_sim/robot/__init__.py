"""The arm: its description (`description`), forward kinematics (`model`) and inverse kinematics
(`inverse`)."""
