"""The ROS side for clients of rosbridge: JSON and CBOR over WebSockets."""
