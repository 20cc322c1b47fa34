// A robot on rosbridge, driven with roslibjs under Node: npm install roslib, then
//
//     iiwa-sim --rosbridge-port 9090
//     node examples/ros_roslibjs.mjs ws://127.0.0.1:9090/dnb-rosbridge

import { Ros, Service, Topic } from "roslib";

const ros = new Ros({ url: process.argv[2] });
await new Promise((connected, failed) => {
  ros.on("connection", connected);
  ros.on("error", failed);
});
ros.authenticate("", "example", "robot", "", 0, "admin", 0); // every one is let in

const command = (number, type, poseType, pose, more = {}) => ({
  command_id: number, command_type: type, pose_type: poseType, pose, velocity_type: "%", velocity: [0.5], ...more,
});
const moves = [
  command(1, "PTP", "JOINTS", [0.3, 0.3, 0, -1.2, 0, 1.3, 0], { blending_type: "%", blending: [0.2] }),
  command(2, "PTP", "JOINTS", [0.0, 0.5, 0, -1.2, 0, 1.3, 0]),
  command(3, "CIRC", "JOINTS", [0, 0, 0, 0, 0, 0, 0]),
];

const results = new Topic({ ros, name: "/command_result", messageType: "robot_movement_interface/Result" });
const ended = new Promise((all) => {
  let count = 0;
  results.subscribe((result) => {
    console.log(`command ${result.command_id} -> ${result.result_code} ${result.additional_information}`);
    if (++count === moves.length) all();
  });
});
const list = new Topic({ ros, name: "/command_list", messageType: "robot_movement_interface/CommandList" });
list.publish({ commands: moves, replace_previous_commands: true });
await ended;

const states = new Topic({ ros, name: "/joint_states", messageType: "sensor_msgs/JointState", throttle_rate: 50 });
const state = await new Promise((first) => states.subscribe(first));
console.log(`at ${state.position.map((q) => q.toFixed(3))}`);

const call = (name, serviceType, request) =>
  new Promise((answered) => new Service({ ros, name, serviceType }).callService(
    request,
    (response) => { console.log(name, JSON.stringify(response)); answered(); },
    (reason) => { console.log(name, "failed:", reason); answered(); },
  ));
await call("/scale_speed", "robot_movement_interface/SetFloat", { value: 0.5 });
await call("/set_io", "robot_movement_interface/SetIO", { number: 17, value: true });
await call("/stop_robot_right_now", "std_srvs/Trigger", {});
await call("/nothing", "std_srvs/Trigger", {});
ros.close();
