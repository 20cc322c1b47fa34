"""iiwa-sim: a robot controller in software that speaks the text protocol of the KUKA LBR iiwa."""
