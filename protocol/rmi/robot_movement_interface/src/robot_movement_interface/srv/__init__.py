from iiwa_sim_msgs.generated import services

globals().update(services("robot_movement_interface"))
