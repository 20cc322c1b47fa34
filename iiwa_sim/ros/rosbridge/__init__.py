"""The ROS side for clients of rosbridge: JSON, PNG and CBOR over WebSockets."""
