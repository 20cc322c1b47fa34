from iiwa_sim_msgs.generated import messages

globals().update(messages("iiwa_sim_msgs"))
