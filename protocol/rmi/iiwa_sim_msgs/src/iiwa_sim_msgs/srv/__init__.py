from iiwa_sim_msgs.generated import services

globals().update(services("iiwa_sim_msgs"))
