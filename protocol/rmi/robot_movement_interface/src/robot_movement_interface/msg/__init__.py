from iiwa_sim_msgs.generated import messages

globals().update(messages("robot_movement_interface"))
